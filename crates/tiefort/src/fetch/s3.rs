//! Buckets: where their files are asked for, the signature for those that are not public, and what they list.
//!
//! A bucket is asked without a signature; only one that refuses strangers gets one, where there are access keys in the
//! environment or in the usual files. The signature (AWS Signature Version 4) is a header, so no address holds it.

use std::fmt::Write;
use std::path::PathBuf;

use ring::digest::{SHA256, digest};
use ring::hmac::{HMAC_SHA256, Key, sign};

use crate::clock::day_text;

/// A variable of the environment.
pub type Variable<'a> = dyn Fn(&str) -> Option<String> + 'a;

/// Bytes of a file of access keys at most.
const FILE_BYTES_MAX: u64 = 1 << 20;
/// The SHA-256 of nothing: what a request for a file sends.
const NOTHING: &str = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

/// Access keys; they are never shown.
pub struct Credentials {
    id: String,
    secret: String,
    token: Option<String>,
    region: String,
}

impl Credentials {
    /// Those of the environment, else those of the profile in the file of keys.
    pub fn find(variable: &Variable) -> Option<Self> {
        let profile = variable("AWS_PROFILE").unwrap_or_else(|| "default".into());
        let file = |own: &str, usual: &str| {
            let home = || variable("HOME").map(|home| PathBuf::from(home).join(".aws").join(usual));
            let path = variable(own).map(PathBuf::from).or_else(home)?;
            let is_small = std::fs::metadata(&path).is_ok_and(|data| data.is_file() && data.len() <= FILE_BYTES_MAX);
            if is_small { std::fs::read_to_string(path).ok() } else { None }
        };
        let keys = file("AWS_SHARED_CREDENTIALS_FILE", "credentials").unwrap_or_default();
        let of_file = |name: &str| value_of(&keys, &[&profile], name);
        let settings = || file("AWS_CONFIG_FILE", "config").unwrap_or_default();
        let region = variable("AWS_REGION").or_else(|| variable("AWS_DEFAULT_REGION"));
        let region = region.or_else(|| value_of(&settings(), &[&profile, &format!("profile {profile}")], "region"));
        let region = region.unwrap_or_else(|| "us-east-1".into());
        let (id, secret, token) = match (variable("AWS_ACCESS_KEY_ID"), variable("AWS_SECRET_ACCESS_KEY")) {
            (Some(id), Some(secret)) => (id, secret, variable("AWS_SESSION_TOKEN")),
            _ => (of_file("aws_access_key_id")?, of_file("aws_secret_access_key")?, of_file("aws_session_token")),
        };
        let token = token.filter(|token| !token.is_empty());
        (!id.is_empty() && !secret.is_empty()).then_some(Self { id, secret, token, region })
    }

    /// The headers of a request for an address so many seconds after the beginning of 1970.
    pub fn headers(&self, url: &str, seconds: u64) -> Vec<(&'static str, String)> {
        let day = &day_text(seconds / 86_400).replace('-', "");
        let rest = url.split_once("://").map_or(url, |(_, rest)| rest);
        let (host, path) = rest.split_once('/').unwrap_or((rest, ""));
        let (path, query) = path.split_once('?').unwrap_or((path, ""));
        let of_day = seconds % 86_400;
        let time = format!("{day}T{:02}{:02}{:02}Z", of_day / 3600, of_day / 60 % 60, of_day % 60);
        let mut headers = vec![("host", host.to_owned()), ("x-amz-content-sha256", NOTHING.into())];
        headers.push(("x-amz-date", time.clone()));
        headers.extend(self.token.iter().map(|token| ("x-amz-security-token", token.clone())));
        let names: Vec<&str> = headers.iter().map(|(name, _)| *name).collect();
        let names = names.join(";");
        let lines: String = headers.iter().map(|(name, value)| format!("{name}:{}\n", value.trim())).collect();
        let request = format!("GET\n/{path}\n{query}\n{lines}\n{names}\n{NOTHING}");
        let scope = format!("{day}/{}/s3/aws4_request", self.region);
        let text =
            format!("AWS4-HMAC-SHA256\n{time}\n{scope}\n{}", hexadecimal(digest(&SHA256, request.as_bytes()).as_ref()));
        let mut key = format!("AWS4{}", self.secret).into_bytes();
        for part in [day, &self.region, "s3", "aws4_request"] {
            key = sign(&Key::new(HMAC_SHA256, &key), part.as_bytes()).as_ref().to_vec();
        }
        let signature = hexadecimal(sign(&Key::new(HMAC_SHA256, &key), text.as_bytes()).as_ref());
        let own =
            format!("AWS4-HMAC-SHA256 Credential={}/{scope}, SignedHeaders={names}, Signature={signature}", self.id);
        headers.remove(0);
        headers.push(("authorization", own));
        headers
    }
}

/// The value of a name in one of some sections of a file of settings.
fn value_of(text: &str, sections: &[&str], name: &str) -> Option<String> {
    let mut is_own = false;
    for line in text.lines().map(str::trim) {
        match line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            Some(section) => is_own = sections.contains(&section.trim()),
            None => match line.split_once('=') {
                Some((key, value)) if is_own && key.trim() == name => return Some(value.trim().to_owned()),
                _ => {}
            },
        }
    }
    None
}

/// The address of a bucket, without a slash at its end.
pub fn bucket_url(bucket: &str, variable: &Variable) -> String {
    match (variable("AWS_ENDPOINT_URL"), variable("AWS_REGION")) {
        (Some(endpoint), _) => format!("{}/{bucket}", endpoint.trim_end_matches('/')),
        // A certificate is for one name before the service's.
        (None, region) if bucket.contains('.') => match region {
            Some(region) => format!("https://s3.{region}.amazonaws.com/{bucket}"),
            None => format!("https://s3.amazonaws.com/{bucket}"),
        },
        (None, Some(region)) => format!("https://{bucket}.s3.{region}.amazonaws.com"),
        // Buckets of other regions are told by a redirect.
        (None, None) => format!("https://{bucket}.s3.amazonaws.com"),
    }
}

/// A part of an address, as a signature wants it: all bytes but some as numbers.
pub fn encoded(text: &str, kept: &str) -> String {
    let mut encoded = String::new();
    for byte in text.bytes() {
        match byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte) || kept.as_bytes().contains(&byte) {
            true => encoded.push(char::from(byte)),
            false => write!(encoded, "%{byte:02X}").expect("a text takes all"),
        }
    }
    encoded
}

/// A file of a bucket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Its key.
    pub key: String,
    /// Its bytes.
    pub len: u64,
    /// The server's mark of its version.
    pub etag: String,
}

/// The files in an answer to a request for a list (`ListObjectsV2`), and the word that asks for the next ones; `None`
/// where it is no such answer.
pub fn listed(text: &str) -> Option<(Vec<Listed>, Option<String>)> {
    let within = |text: &str, name: &str| {
        let (_, rest) = text.split_once(&format!("<{name}>"))?;
        rest.split_once(&format!("</{name}>")).map(|(inner, _)| plain(inner))
    };
    let (_, result) = text.split_once("<ListBucketResult")?;
    let mut files = Vec::new();
    for part in result.split("<Contents>").skip(1) {
        let part = part.split("</Contents>").next().unwrap_or_default();
        let (key, len) = (within(part, "Key")?, within(part, "Size")?.parse().ok()?);
        files.push(Listed { key, len, etag: within(part, "ETag").unwrap_or_default() });
    }
    let is_more = within(result, "IsTruncated").is_some_and(|text| text == "true");
    Some((files, if is_more { within(result, "NextContinuationToken") } else { None }))
}

/// A text of XML as it is meant.
fn plain(text: &str) -> String {
    let marks = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#34;", "\""), ("&apos;", "'"), ("&#39;", "'")];
    marks.iter().fold(text.to_owned(), |text, (mark, meant)| text.replace(mark, meant)).replace("&amp;", "&")
}

/// Whether a key fits a pattern: a `*` stands for any letters but `/`, `**` for those, too.
pub fn fits(pattern: &str, key: &str) -> bool {
    let Some(at) = pattern.find('*') else { return pattern == key };
    let Some(rest) = key.strip_prefix(&pattern[..at]) else { return false };
    let (is_deep, after) = match pattern[at + 1..].strip_prefix('*') {
        Some(after) => (true, after),
        None => (false, &pattern[at + 1..]),
    };
    let ends = rest.char_indices().map(|(end, _)| end).chain([rest.len()]);
    ends.take_while(|&end| is_deep || !rest[..end].contains('/')).any(|end| fits(after, &rest[end..]))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of Amazon's own guide to the signature of a request for a list.
    #[test]
    fn a_signature_is_that_of_the_guide() {
        let credentials = Credentials {
            id: "AKIAIOSFODNN7EXAMPLE".into(),
            secret: "wJalrXUtnFEMI/K7MDENG/bPxRfiCYEXAMPLEKEY".into(),
            token: None,
            region: "us-east-1".into(),
        };
        let url = "https://examplebucket.s3.amazonaws.com/?max-keys=2&prefix=J";
        let headers = credentials.headers(url, 1_369_353_600);
        let own = &headers.last().unwrap().1;
        let expected = "34b48302e7b5fa45bde8084f4b7868a86f0a534bc59db6670ed5711ef69dc6f7";
        assert!(own.ends_with(&format!("Signature={expected}")), "{own}");
    }

    #[test]
    fn access_keys_are_those_of_the_environment_else_of_the_profile() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("keys");
        std::fs::write(
            &path,
            "[default]\naws_access_key_id = a\naws_secret_access_key=b\n[x]\naws_access_key_id = c\n",
        )
        .unwrap();
        let path = path.to_string_lossy().into_owned();
        let find = |set: &[(&str, &str)]| {
            let variable = |name: &str| match name {
                "AWS_SHARED_CREDENTIALS_FILE" => Some(path.clone()),
                _ => set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()),
            };
            Credentials::find(&variable).map(|found| (found.id, found.secret, found.region))
        };
        let text = |a: &str, b: &str, c: &str| Some((a.to_owned(), b.to_owned(), c.to_owned()));
        assert_eq!(find(&[]), text("a", "b", "us-east-1"));
        assert_eq!(find(&[("AWS_PROFILE", "x")]), None);
        let own = [("AWS_ACCESS_KEY_ID", "e"), ("AWS_SECRET_ACCESS_KEY", "f"), ("AWS_REGION", "g")];
        assert_eq!(find(&own), text("e", "f", "g"));
    }

    #[test]
    fn lists_are_read_and_patterns_fit_within_a_folder() {
        let text = "<?xml?><ListBucketResult xmlns=\"x\"><IsTruncated>true</IsTruncated><Contents><Key>a&amp;b</Key>\
            <ETag>&quot;e&quot;</ETag><Size>7</Size></Contents><NextContinuationToken>t</NextContinuationToken>\
            </ListBucketResult>";
        let file = Listed { key: "a&b".into(), len: 7, etag: "\"e\"".into() };
        assert_eq!(listed(text), Some((vec![file], Some("t".into()))));
        assert_eq!(listed("<Error/>"), None);
        assert!(
            fits("a/type=segment/*", "a/type=segment/x.parquet")
                && fits("a/*/b*.p", "a/c/bd.p")
                && fits("**.p", "a/b.p")
        );
        assert!(!fits("a/*", "a/b/c") && !fits("a/*.p", "a/b.q") && !fits("a", "ab"));
    }
}
