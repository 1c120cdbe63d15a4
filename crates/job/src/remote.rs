//! Addresses of files of other machines, in the place of paths.
//!
//! What follows a `?` may be a signature that opens the file to anyone who has it: names and messages are without it.

const SCHEMES: [&str; 3] = ["https://", "http://", "s3://"];

/// Whether a name in a job is an address on another machine, of a scheme that is followed or not.
pub fn is_remote(written: &str) -> bool {
    let scheme = written.split_once("://").map_or("", |(scheme, _)| scheme);
    !scheme.is_empty() && scheme.bytes().all(|byte| byte.is_ascii_alphanumeric())
}

/// An address without what follows its `?`, which may be a signature.
pub fn without_query(address: &str) -> &str {
    address.split(['?', '#']).next().unwrap_or(address)
}

/// Text in which every address is without what follows its `?`, and without a name and a password.
pub(crate) fn without_secrets(text: &str) -> String {
    let (mut kept, mut rest) = (String::new(), text);
    while let Some(at) = rest.find("://") {
        let (before, after) = rest.split_at(at + 3);
        kept += before;
        let end = after.find(|c: char| c == '"' || c == '\'' || c.is_whitespace()).unwrap_or(after.len());
        let address = without_query(&after[..end]);
        let host_end = address.find('/').unwrap_or(address.len());
        kept += &address[address[..host_end].rfind('@').map_or(0, |at| at + 1)..];
        rest = &after[end..];
    }
    kept + rest
}

/// Checks an address that a job names, or that a server sends a client on to.
///
/// # Errors
/// What would do, in words, when it is none that is followed.
pub fn check_address(address: &str) -> Result<(), &'static str> {
    const ADDRESS: &str = "an address such as https://host/file.tif or s3://bucket/file.tif";
    let (scheme, rest) = address.split_once("://").ok_or(ADDRESS)?;
    let (host, path) = without_query(rest).split_once('/').ok_or(ADDRESS)?;
    if !SCHEMES.iter().any(|known| known.strip_suffix("://") == Some(scheme)) {
        return Err("an address that begins with https:// or s3://");
    }
    if host.contains('@') {
        return Err("an address without a name and a password in it");
    }
    let is_plain = !address.contains(|c: char| c.is_control() || c.is_whitespace() || c == '"' || c == '\\');
    // Only buckets list what they have.
    let is_pattern = path.contains('[') || scheme != "s3" && path.contains('*');
    if host.is_empty() || path.is_empty() || path.ends_with('/') || !is_plain || is_pattern || host.contains('*') {
        return Err(ADDRESS);
    }
    if scheme == "http" && !is_loopback(host) {
        return Err("https://, or http:// to this machine itself");
    }
    Ok(())
}

/// Whether a host, with a port or without, is this machine.
fn is_loopback(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or(""),
        None => host.split(':').next().unwrap_or(""),
    };
    name == "localhost" || name.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_of_https_or_of_this_machine_and_holds_no_password() {
        for good in ["https://a.org/x.tif", "https://a.org/x.tif?sign=1/2", "s3://b/k/x.tif", "http://127.0.0.1:80/x"] {
            assert_eq!(check_address(good), Ok(()), "{good}");
        }
        assert_eq!(check_address("http://[::1]:8080/x.tif"), Ok(()));
        assert_eq!(check_address("s3://b/type=segment/*"), Ok(()));
        for bad in [
            "http://a.org/x.tif",
            "ftp://a.org/x",
            "file:///etc/passwd",
            "https://a.org",
            "https:///x",
            "https://u:p@a/x",
        ] {
            assert!(check_address(bad).is_err(), "{bad}");
        }
        for bad in ["https://a.org/*.tif", "https://a.org/a b.tif", "https://a.org/folder/", "http://127.0.0.1.a.org/x"]
        {
            assert!(check_address(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn signatures_are_in_no_message() {
        for (text, told) in [
            ("[\"https://a.org/x.tif?X-Sig=secret\", \"b?.tif\"]", "[\"https://a.org/x.tif\", \"b?.tif\"]"),
            ("'https://a.org/x.tif?secret', 's3://b/y#z'", "'https://a.org/x.tif', 's3://b/y'"),
            ("\"ftp://me:secret@a.org/x\"", "\"ftp://a.org/x\""),
            ("{ file = \"https://a.org?x=secret", "{ file = \"https://a.org"),
        ] {
            assert_eq!(without_secrets(text), told);
        }
    }
}
