//! Addresses: what a job names, and what is asked for over HTTP.

use job::without_query;

use super::fault::Fault;
use super::s3::{Variable, bucket_url, encoded};

/// An address that is asked for, which messages show without what follows its `?`.
#[derive(Clone, PartialEq, Eq)]
pub struct Address {
    url: String,
    /// The bucket and the key, of a file that is named by them.
    bucket: Option<(String, String)>,
}

impl Address {
    /// What is asked for a file that a job names; `variable` gives a variable of the environment.
    ///
    /// # Errors
    /// When the region or the endpoint of an `s3://` address makes no address that is followed.
    pub fn of(named: &str, variable: &Variable) -> Result<Self, Fault> {
        match in_bucket(named) {
            None => Self::checked(named.to_owned(), None),
            Some((bucket, key)) => {
                let url = format!("{}/{}", bucket_url(bucket, variable), encoded(key, "/"));
                Self::checked(url, Some((bucket, key)))
            }
        }
    }

    /// What is asked for a list of the files of a bucket whose keys begin with `prefix`; `token` asks for those behind
    /// what came before.
    ///
    /// # Errors
    /// As [`Address::of`].
    pub fn of_list(bucket: &str, prefix: &str, token: Option<&str>, variable: &Variable) -> Result<Self, Fault> {
        let token = token.map(|token| format!("continuation-token={}&", encoded(token, ""))).unwrap_or_default();
        let url = format!("{}/?{token}list-type=2&prefix={}", bucket_url(bucket, variable), encoded(prefix, ""));
        // A list is of a folder, which no file is.
        Self::checked(url.replace("/?", "/-?"), Some((bucket, prefix))).map(|address| Self { url, ..address })
    }

    /// Where a server sends a client on to.
    ///
    /// # Errors
    /// When that is another scheme, a path of this machine, or less safe than where it was asked.
    pub fn redirected(&self, location: &str) -> Result<Self, Fault> {
        let shown = without_query(location);
        let scheme_end = self.url.find("://").map_or(0, |at| at + 3);
        let host_end = self.url[scheme_end..].find('/').map_or(self.url.len(), |at| scheme_end + at);
        let has_scheme = location.split(['/', '?']).next().is_some_and(|first| first.contains(':'));
        let url = match location.strip_prefix('/') {
            Some(rest) if !rest.starts_with('/') => format!("{}{location}", &self.url[..host_end]),
            None if !has_scheme && !location.is_empty() => {
                format!("{}{}", &self.url[..host_end], beside(&without_query(&self.url)[host_end..], location))
            }
            _ => location.to_owned(),
        };
        let is_less_safe = self.url.starts_with("https://") && !url.starts_with("https://");
        if is_less_safe || !url.starts_with("http") {
            return Err(Fault::last(format!("{self}: it leads on to {shown}, which is not followed")));
        }
        Self::checked(url, None)
            .map_err(|_| Fault::last(format!("{self}: it leads on to {shown}, which is not followed")))
    }

    fn checked(url: String, bucket: Option<(&str, &str)>) -> Result<Self, Fault> {
        match job::check_address(&url) {
            Ok(()) => Ok(Self { url, bucket: bucket.map(|(name, key)| (name.to_owned(), key.to_owned())) }),
            Err(expected) => {
                Err(Fault::last(format!("{}: found this address, expected {expected}", without_query(&url))))
            }
        }
    }

    /// The whole address, for the request alone.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// The host, with its port where it has one.
    pub fn host(&self) -> &str {
        let rest = self.url.split_once("://").map_or(self.url.as_str(), |(_, rest)| rest);
        rest.split(['/', '?']).next().unwrap_or_default()
    }

    /// The bucket that the job named it by, whose owner may want a signature.
    pub fn bucket(&self) -> Option<&str> {
        self.bucket.as_ref().map(|(name, _)| name.as_str())
    }

    /// Its key in the bucket; empty where it is not named by one.
    pub fn key(&self) -> &str {
        self.bucket.as_ref().map_or("", |(_, key)| key)
    }

    /// Whether it is of this machine itself, where no proxy lies between.
    pub fn is_of_this_machine(&self) -> bool {
        self.url.starts_with("http://")
    }
}

/// The path that another is relative to a path, as `../y.tif` to `/a/b/x.tif`.
fn beside(path: &str, relative: &str) -> String {
    let (relative, query) = relative.split_at(relative.find('?').unwrap_or(relative.len()));
    let mut parts: Vec<&str> = path.split('/').skip(1).collect();
    parts.pop();
    for part in relative.split('/') {
        match part {
            "." => {}
            ".." => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    format!("/{}{query}", parts.join("/"))
}

/// The bucket and the key of an address of a bucket.
pub fn in_bucket(named: &str) -> Option<(&str, &str)> {
    named.strip_prefix("s3://").and_then(|rest| rest.split_once('/'))
}

impl std::fmt::Debug for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{self}")
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(without_query(&self.url))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_is_asked_for_where_the_environment_says() {
        let url = |set: &[(&str, &str)]| {
            let variable = |name: &str| set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned());
            Address::of("s3://b/k/x.tif", &variable).map(|address| address.url().to_owned()).map_err(|fault| fault.text)
        };
        assert_eq!(url(&[]).unwrap(), "https://b.s3.amazonaws.com/k/x.tif");
        assert_eq!(url(&[("AWS_REGION", "eu-west-1")]).unwrap(), "https://b.s3.eu-west-1.amazonaws.com/k/x.tif");
        assert_eq!(url(&[("AWS_ENDPOINT_URL", "http://127.0.0.1:9000/")]).unwrap(), "http://127.0.0.1:9000/b/k/x.tif");
        assert!(url(&[("AWS_ENDPOINT_URL", "http://a.org")]).is_err());
    }

    #[test]
    fn redirects_lead_to_no_file_no_other_scheme_and_nothing_less_safe() {
        let none = |_: &str| None;
        let from = |url: &str| Address::of(url, &none).unwrap();
        let good = from("https://a.org/x.tif?s=1");
        assert_eq!(good.redirected("/y.tif").unwrap().url(), "https://a.org/y.tif");
        let deep = from("https://a.org/b/c/x.tif?k=1");
        for (location, expected) in [
            ("../cog.tif", "https://a.org/b/cog.tif"),
            ("y.tif?t=a/b", "https://a.org/b/c/y.tif?t=a/b"),
            ("./d/y.tif", "https://a.org/b/c/d/y.tif"),
            ("../../../../y.tif", "https://a.org/y.tif"),
        ] {
            assert_eq!(deep.redirected(location).unwrap().url(), expected);
        }
        assert_eq!(good.redirected("https://b.org/y.tif?t=2").unwrap().url(), "https://b.org/y.tif?t=2");
        for bad in ["file:///etc/passwd", "s3://b/x.tif", "http://127.0.0.1/x.tif", "//b.org/x", "", "ftp://a/x"] {
            let fault = good.redirected(bad).unwrap_err().text;
            assert!(fault.contains("is not followed") && !fault.contains("s=1"), "{fault}");
        }
        assert!(from("http://127.0.0.1/x").redirected("http://a.org/x").is_err());
    }
}
