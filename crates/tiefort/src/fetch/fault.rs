//! Why something was not fetched, in a sentence without signatures.

/// Why something was not fetched.
#[derive(Clone, Debug)]
pub struct Fault {
    /// What happened, without signatures.
    pub text: String,
    /// What may help.
    pub hint: &'static str,
    kind: Kind,
}

/// What may be done about a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Trying again does not help.
    Last,
    /// The same request may succeed later.
    Passing,
    /// The server is silent, and may answer later.
    Silent,
    /// The server has another version.
    Changed,
}

impl Fault {
    /// One that trying again does not help.
    pub fn last(text: String) -> Self {
        Self { text, hint: "check the address in the job", kind: Kind::Last }
    }

    /// The same with a hint.
    pub fn hinted(text: String, hint: &'static str) -> Self {
        Self { text, hint, kind: Kind::Last }
    }

    /// Whether the same request may succeed later.
    pub fn may_pass(&self) -> bool {
        matches!(self.kind, Kind::Passing | Kind::Silent)
    }

    /// Whether the server has another version than is wanted.
    pub fn is_change(&self) -> bool {
        self.kind == Kind::Changed
    }

    /// Whether the server sent nothing for as long as it is waited for.
    pub fn is_silent(&self) -> bool {
        self.kind == Kind::Silent
    }

    /// A server that sends nothing.
    pub fn silent(text: String) -> Self {
        Self { kind: Kind::Silent, ..Self::passing(text) }
    }

    /// One that may pass.
    pub fn passing(text: String) -> Self {
        Self { text, hint: "run the same command again: what has come is kept", kind: Kind::Passing }
    }
}

/// The server has another version than is wanted.
pub fn changed(address: &str, wanted: &str, found: &str) -> Fault {
    let text = format!("{address}: it has changed on the server: found version {found}, expected {wanted}");
    Fault { kind: Kind::Changed, ..Fault::hinted(text, "tiefort fetch --update takes the new one") }
}

/// A web page in the place of a file.
pub fn page(shown: &str) -> Fault {
    let hint = "open the address in a browser: it may ask to log in or to agree to terms; take an address that gives \
                the file itself, or fetch it by other means and name it by its path";
    Fault::hinted(format!("{shown}: found a web page (HTML), expected the file"), hint)
}
