//! The bytes of a file of another machine, fetched in blocks as they are read: for its directories.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};

use super::address::Address;
use super::client::Client;
use super::fault::Fault;

/// Bytes of a block: the directories of a raster of a degree lie in the first.
const BLOCK: u64 = 16 << 10;
/// Blocks of one file, at most: directories of four million tiles.
const BLOCKS_MAX: usize = 1 << 13;

/// A file of another machine, open for reading.
pub struct RemoteReader<'a> {
    client: &'a Client<'a>,
    address: Address,
    /// Its bytes.
    pub total: u64,
    /// The server's mark of its version.
    pub etag: String,
    at: u64,
    blocks: BTreeMap<u64, Vec<u8>>,
    /// Why the last read failed; an `io::Error` has no room for a hint.
    pub fault: Option<Fault>,
}

impl<'a> RemoteReader<'a> {
    /// Opens the file by its first block.
    ///
    /// # Errors
    /// When the server does not give it.
    pub fn open(client: &'a Client<'a>, address: Address) -> Result<Self, Fault> {
        let first = client.range(&address, 0, BLOCK, None)?;
        let blocks = BTreeMap::from([(0, first.bytes)]);
        Ok(Self { client, address, total: first.total, etag: first.etag, at: 0, blocks, fault: None })
    }

    fn block(&mut self, number: u64) -> io::Result<&[u8]> {
        if !self.blocks.contains_key(&number) {
            if BLOCKS_MAX <= self.blocks.len() {
                return Err(io::Error::other("its directories are too long"));
            }
            let answer = self.client.range(&self.address, number * BLOCK, BLOCK, Some(&self.etag));
            let answer = answer.map_err(|fault| {
                self.fault = Some(fault.clone());
                io::Error::other(fault.text)
            })?;
            self.blocks.insert(number, answer.bytes);
        }
        Ok(&self.blocks[&number])
    }
}

impl Read for RemoteReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.total <= self.at {
            return Ok(0);
        }
        let (number, inside) = (self.at / BLOCK, (self.at % BLOCK) as usize);
        let block = self.block(number)?;
        let taken = buffer.len().min(block.len().saturating_sub(inside));
        buffer[..taken].copy_from_slice(&block[inside..inside + taken]);
        self.at += taken as u64;
        Ok(taken)
    }
}

impl Seek for RemoteReader<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => self.total.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
        Ok(self.at)
    }
}
