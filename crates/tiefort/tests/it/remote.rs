//! A server of files on this machine that does what servers do wrong, and a raster in tiles to fetch from it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

use flate2::write::ZlibEncoder;
use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

/// GeoParquet of roads a kilometre long in a row group each, from these longitudes on, at 35.32 north.
pub fn roads_parquet(longitudes: &[f64]) -> Vec<u8> {
    const SCHEMA: &str = "message schema { required binary geometry; required group bbox { required double xmin; \
        required double xmax; required double ymin; required double ymax; } required binary highway (UTF8); }";
    let geo = r#"{"primary_column":"geometry","columns":{"geometry":{"encoding":"WKB"}}}"#.to_owned();
    let said = Some(vec![KeyValue::new("geo".into(), geo)]);
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).set_key_value_metadata(said);
    let schema = Arc::new(parse_message_type(SCHEMA).unwrap());
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties.build())).unwrap();
    for &west in longitudes {
        let ends = [west, 35.32, west + 0.01, 35.325];
        let mut line = vec![1, 2, 0, 0, 0, 2, 0, 0, 0];
        ends.iter().for_each(|number| line.extend(number.to_le_bytes()));
        let texts = [ByteArray::from(line), "primary".into()];
        let mut group = file.next_row_group().unwrap();
        for at in 0..6 {
            let mut column = group.next_column().unwrap().unwrap();
            let written = match at {
                0 | 5 => column.typed::<ByteArrayType>().write_batch(&texts[at / 5..][..1], None, None),
                _ => column.typed::<DoubleType>().write_batch(&[ends[[0, 2, 1, 3][at - 1]]], None, None),
            };
            written.unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
    }
    file.close().unwrap();
    bytes
}

/// What the server does with a request.
#[derive(Clone, Debug, PartialEq)]
pub enum Manner {
    Sound,
    /// Answers 200 with the whole file, whatever is asked for.
    NoRanges,
    /// Answers so many requests with this status, then soundly.
    Status(u16, usize),
    /// Says that the bytes are other ones.
    OtherRange,
    /// Ends every answer after half of its bytes.
    Truncated,
    /// Goes on behind the bytes that were asked for.
    Endless,
    /// Leads on to this address.
    Redirect(String),
    /// Says that the file has so many bytes.
    Total(u64),
    /// Gives 403 from this request on.
    CutAfter(usize),
    /// Sends half of an answer, and then nothing more.
    Silent,
    /// Sends other bytes than it has, but for the beginning of a file.
    Damaged,
    /// Sends a page to log in on.
    Page,
    /// Packs what it sends, whatever it was asked.
    Packed,
    /// Gives 403 to requests without this access key.
    Closed(String),
}

/// The server; its thread ends with the process.
#[derive(Clone)]
pub struct FileServer {
    pub host: String,
    shared: Arc<Shared>,
}

struct Shared {
    files: Mutex<Vec<(String, Vec<u8>, String)>>,
    manner: Mutex<Manner>,
    requests: AtomicUsize,
    sent: AtomicU64,
}

impl FileServer {
    /// Serves files by name, each with the mark of its version.
    pub fn start(files: &[(&str, Vec<u8>)]) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let host = format!("http://{}", listener.local_addr().unwrap());
        let files = files.iter().map(|(name, bytes)| (format!("/{name}"), bytes.clone(), "\"v1\"".to_owned()));
        let shared = Shared {
            files: Mutex::new(files.collect()),
            manner: Mutex::new(Manner::Sound),
            requests: AtomicUsize::new(0),
            sent: AtomicU64::new(0),
        };
        let server = Self { host, shared: Arc::new(shared) };
        let own = server.clone();
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let shared = own.shared.clone();
                // A client may go away in the middle.
                thread::spawn(move || drop(shared.answer(stream)));
            }
        });
        server
    }

    /// From now on it does this, and counts requests from 0.
    pub fn behave(&self, manner: Manner) {
        self.shared.requests.store(0, Ordering::SeqCst);
        *self.shared.manner.lock().unwrap() = manner;
    }

    /// Gives a file another mark.
    pub fn change(&self, etag: &str) {
        self.shared.files.lock().unwrap().iter_mut().for_each(|file| file.2 = etag.to_owned());
    }

    pub fn requests(&self) -> usize {
        self.shared.requests.load(Ordering::SeqCst)
    }

    /// Bytes of bodies sent so far.
    pub fn sent(&self) -> u64 {
        self.shared.sent.load(Ordering::SeqCst)
    }
}

impl Shared {
    fn answer(&self, stream: TcpStream) -> std::io::Result<()> {
        let mut reader = BufReader::new(stream.try_clone()?);
        let (mut line, mut range, mut key) = (String::new(), None, String::new());
        reader.read_line(&mut line)?;
        let path = line.split(' ').nth(1).unwrap_or_default().split('?').next().unwrap_or_default().to_owned();
        loop {
            let mut header = String::new();
            if reader.read_line(&mut header)? <= 2 {
                break;
            }
            if header.to_ascii_lowercase().starts_with("authorization: aws4-hmac-sha256 ") {
                key = header.clone();
            }
            if let Some(bytes) = header.to_ascii_lowercase().strip_prefix("range: bytes=") {
                let (first, last) = bytes.trim().split_once('-').unwrap();
                range = Some((first.parse::<u64>().unwrap(), last.parse::<u64>().unwrap()));
            }
        }
        let count = self.requests.fetch_add(1, Ordering::SeqCst);
        let mut manner = self.manner.lock().unwrap().clone();
        if let Manner::Closed(id) = &manner {
            let is_let_in = key.contains(&format!("Credential={id}/"));
            manner = if is_let_in { Manner::Sound } else { Manner::CutAfter(0) };
        }
        self.send(stream, &path, range, (manner, count))
    }

    fn send(
        &self,
        mut stream: TcpStream,
        path: &str,
        range: Option<(u64, u64)>,
        (manner, count): (Manner, usize),
    ) -> std::io::Result<()> {
        let file = self.files.lock().unwrap().iter().find(|file| file.0 == path).cloned();
        let plain = |status: &str, more: &str| {
            format!("HTTP/1.1 {status}\r\n{more}Content-Length: 0\r\nConnection: close\r\n\r\n")
        };
        let status = match &manner {
            Manner::Status(status, times) if count < *times => Some(*status),
            Manner::CutAfter(times) if *times <= count => Some(403),
            _ if file.is_none() => Some(404),
            _ => None,
        };
        if let Some(status) = status {
            return stream.write_all(plain(&format!("{status} As asked"), "").as_bytes());
        }
        if let Manner::Redirect(to) = &manner {
            return stream.write_all(plain("302 Found", &format!("Location: {to}\r\n")).as_bytes());
        }
        if manner == Manner::Page {
            let head = "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=utf-8\r\nContent-Length: 6\r\n";
            return stream.write_all(format!("{head}Connection: close\r\n\r\nLog in").as_bytes());
        }
        if manner == Manner::Packed {
            let head = "HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: 2\r\n";
            return stream.write_all(&[format!("{head}Connection: close\r\n\r\n").as_bytes(), b"\x1f\x8b"].concat());
        }
        let (_, bytes, etag) = file.unwrap();
        let total = if let Manner::Total(total) = manner { total } else { bytes.len() as u64 };
        let (first, last) = range.filter(|_| manner != Manner::NoRanges).unwrap_or((0, bytes.len() as u64 - 1));
        let last = last.min(bytes.len() as u64 - 1);
        if bytes.len() as u64 <= first {
            return stream.write_all(plain("416 Range Not Satisfiable", "").as_bytes());
        }
        let mut body = bytes[first as usize..=last as usize].to_vec();
        if manner == Manner::Damaged && 0 < first {
            let middle = body.len() / 2;
            body[middle..].fill(0xaa);
        }
        let mut head = format!("ETag: {etag}\r\nConnection: close\r\n");
        let status = match range.filter(|_| manner != Manner::NoRanges) {
            None => "200 OK",
            Some(_) => {
                let shift = u64::from(manner == Manner::OtherRange);
                head += &format!("Content-Range: bytes {}-{}/{total}\r\n", first + shift, last + shift);
                "206 Partial Content"
            }
        };
        match manner {
            Manner::Endless => body.extend(vec![0; 1 << 16]),
            _ => head += &format!("Content-Length: {}\r\n", body.len()),
        }
        if manner == Manner::Truncated || manner == Manner::Silent {
            body.truncate(body.len() / 2);
        }
        self.sent.fetch_add(body.len() as u64, Ordering::SeqCst);
        stream.write_all(format!("HTTP/1.1 {status}\r\n{head}\r\n").as_bytes())?;
        stream.write_all(&body)?;
        if manner == Manner::Silent {
            thread::sleep(std::time::Duration::from_secs(600));
        }
        // What a client does not read must not make the system take back what it has not read yet.
        let _ = stream.shutdown(std::net::Shutdown::Write);
        let _ = stream.take(1).read(&mut [0]);
        Ok(())
    }
}

/// Posts a side of the raster, and of a tile of it.
pub const POSTS: usize = 768;
const TILE: usize = 128;

/// A GeoTIFF of floats in deflated tiles, 25 m apart, EPSG:32611, its north-western corner at 500 km, 3920 km, with
/// an overview of half as many posts; and the length of each tile of the raster itself, row by row from the north.
pub fn tiled_raster() -> (Vec<u8>, Vec<u64>) {
    let height = |row: usize, col: usize| {
        // Hills, and what a packer cannot guess.
        let noise = (row * 7919 + col * 104_729) % 1009;
        600.0 + 200.0 * ((row as f32 / 90.0).sin() + (col as f32 / 70.0).cos()) + noise as f32 / 256.0
    };
    let tiles = |posts: usize, step: usize| {
        let across = posts.div_ceil(TILE);
        let tile = |index: usize| {
            let (top, left) = (index / across * TILE, index % across * TILE);
            let mut packer = ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            for row in top..top + TILE {
                for col in left..left + TILE {
                    packer.write_all(&height(row * step, col * step).to_le_bytes()).unwrap();
                }
            }
            packer.finish().unwrap()
        };
        (0..across * across).map(tile).collect::<Vec<Vec<u8>>>()
    };
    let levels = [(POSTS, tiles(POSTS, 1)), (POSTS / 2, tiles(POSTS / 2, 2))];
    let sizes = levels[0].1.iter().map(|tile| tile.len() as u64).collect();
    // Directories come first, as in a cloud-optimised file: they are laid out once for their length.
    let mut file = directories(&levels, directories(&levels, 0).len());
    levels.iter().for_each(|(_, tiles)| tiles.iter().for_each(|tile| file.extend(tile)));
    (file, sizes)
}

fn directories(levels: &[(usize, Vec<Vec<u8>>)], data: usize) -> Vec<u8> {
    let mut file = b"II\x2a\0\x08\0\0\0".to_vec();
    let mut at = data;
    for (level, (posts, tiles)) in levels.iter().enumerate() {
        let longs = |numbers: &[u32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
        let doubles = |numbers: &[f64]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
        let shorts = |numbers: &[u16]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
        let offsets: Vec<u32> = tiles
            .iter()
            .map(|tile| {
                at += tile.len();
                (at - tile.len()) as u32
            })
            .collect();
        let sizes: Vec<u32> = tiles.iter().map(|tile| tile.len() as u32).collect();
        let mut tags: Vec<(u16, u16, usize, Vec<u8>)> = vec![
            (254, 4, 1, longs(&[u32::from(level != 0)])),
            (256, 4, 1, longs(&[*posts as u32])),
            (257, 4, 1, longs(&[*posts as u32])),
            (258, 3, 1, shorts(&[32])),
            (259, 3, 1, shorts(&[8])),
            (262, 3, 1, shorts(&[1])),
            (277, 3, 1, shorts(&[1])),
            (322, 4, 1, longs(&[TILE as u32])),
            (323, 4, 1, longs(&[TILE as u32])),
            (324, 4, tiles.len(), longs(&offsets)),
            (325, 4, tiles.len(), longs(&sizes)),
            (339, 3, 1, shorts(&[3])),
        ];
        if level == 0 {
            tags.push((33550, 12, 3, doubles(&[25.0, 25.0, 0.0])));
            tags.push((33922, 12, 6, doubles(&[0.0, 0.0, 0.0, 500_000.0, 3_920_000.0, 0.0])));
            let keys = [1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32611, 4096, 0, 1, 5773];
            tags.push((34735, 3, keys.len(), shorts(&keys)));
        }
        let values_at = file.len() + 2 + tags.len() * 12 + 4;
        let mut values = Vec::new();
        file.extend((tags.len() as u16).to_le_bytes());
        for (tag, kind, count, bytes) in tags {
            file.extend(tag.to_le_bytes());
            file.extend(kind.to_le_bytes());
            file.extend((count as u32).to_le_bytes());
            if bytes.len() <= 4 {
                file.extend([bytes.as_slice(), &[0; 4][bytes.len()..]].concat());
            } else {
                file.extend(((values_at + values.len()) as u32).to_le_bytes());
                values.extend(bytes);
            }
        }
        let next = if level + 1 < levels.len() { values_at + values.len() } else { 0 };
        file.extend((next as u32).to_le_bytes());
        file.extend(values);
    }
    file
}
