//! The one door to `bincode`: fixed-width little-endian integers, a limit on size, no bytes left over.
//!
//! The crate is no longer maintained upstream, so nothing else names it; the layout is simple enough for any
//! successor (a list is its length as `u64`, then its items; an option is a byte, then its value).

use bincode::Options;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Bytes of the longest payload: a tile of 4096 x 4096 posts, every post a vertex, takes 0.6 GiB.
pub(crate) const PAYLOAD_BYTES_MAX: u64 = 1 << 30;

fn options() -> impl Options {
    bincode::DefaultOptions::new()
        .with_little_endian()
        .with_fixint_encoding()
        .with_limit(PAYLOAD_BYTES_MAX)
        .reject_trailing_bytes()
}

/// The bytes of `value`.
///
/// # Panics
/// When they are more than [`PAYLOAD_BYTES_MAX`]: no plan lets a tile grow that large.
pub(crate) fn encode(value: &impl Serialize) -> Vec<u8> {
    options().serialize(value).expect("plain values of a bounded tile always encode")
}

/// The value whose bytes these are.
///
/// # Errors
/// What is wrong with the bytes, in words.
pub(crate) fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    options().deserialize(bytes).map_err(|error| error.to_string())
}

/// The bytes of `value`, small numbers in few of them: below 251 in one, and signed ones below 126 either way.
pub(crate) fn encode_small(value: &impl Serialize) -> Vec<u8> {
    options().with_varint_encoding().serialize(value).expect("plain values of a bounded area always encode")
}

/// The value that [`encode_small`] gave these bytes for.
///
/// # Errors
/// What is wrong with the bytes, in words.
pub(crate) fn decode_small<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    options().with_varint_encoding().deserialize(bytes).map_err(|error| error.to_string())
}

/// The value whose bytes begin these, and what follows it, if anything does.
///
/// # Errors
/// What is wrong with the bytes, in words.
pub(crate) fn decode_two<A: DeserializeOwned, B: DeserializeOwned>(bytes: &[u8]) -> Result<(A, Option<B>), String> {
    let mut rest = bytes;
    let first = options()
        .allow_trailing_bytes()
        .deserialize_from(&mut rest)
        .map_err(|error: bincode::Error| error.to_string())?;
    Ok((first, if rest.is_empty() { None } else { Some(decode(rest)?) }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_its_length_and_its_items() {
        assert_eq!(encode(&vec![(1u16, -1i32)]), [1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 255, 255, 255, 255]);
    }

    #[test]
    fn an_absurd_length_is_an_error_and_no_allocation() {
        assert!(decode::<Vec<u64>>(&[255; 8]).is_err());
        assert!(decode::<Vec<u64>>(&[255, 255, 255, 255, 255, 0, 0, 0, 1]).is_err());
    }

    #[test]
    fn small_numbers_take_few_bytes() {
        let value = vec![(7u16, -1i32), (300, 125), (1, -1000)];
        assert_eq!(encode_small(&value), [3, 7, 1, 251, 44, 1, 250, 1, 251, 207, 7]);
        assert_eq!(decode_small::<Vec<(u16, i32)>>(&encode_small(&value)), Ok(value));
        assert!(decode_small::<Vec<u64>>(&[253, 255, 255, 255, 255, 255, 255, 255, 255]).is_err());
    }

    #[test]
    fn a_second_value_is_there_or_not() {
        assert_eq!(decode_two::<u16, u8>(&[7, 0]), Ok((7, None)));
        assert_eq!(decode_two::<u16, u8>(&[7, 0, 9]), Ok((7, Some(9))));
        assert!(decode_two::<u16, u8>(&[7, 0, 9, 9]).is_err() && decode_two::<u16, u8>(&[7]).is_err());
    }

    #[test]
    fn extra_bytes_are_an_error() {
        assert_eq!(decode::<u16>(&[7, 0]), Ok(7));
        assert!(decode::<u16>(&[7, 0, 0]).is_err());
    }
}
