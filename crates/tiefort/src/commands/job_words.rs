//! Words of a job that is written for a person: comments, texts and paths.

use std::path::{MAIN_SEPARATOR, Path, PathBuf};

use views::fold;

/// `text` as a comment above a source, in lines as wide as a terminal.
pub fn comment(text: &str) -> String {
    let line = format!("    # {}", text.split_whitespace().collect::<Vec<_>>().join(" "));
    fold(&line, 0).replace("\n    ", "\n    # ") + "\n"
}

/// The path as a job in `folder` names it, on any system with `/` between folders.
pub fn relative(path: &Path, folder: &Path) -> String {
    let here = |path: &Path| if path.as_os_str().is_empty() { PathBuf::from(".") } else { path.to_owned() };
    let (Ok(file), Ok(folder)) = (path.canonicalize(), here(folder).canonicalize()) else {
        return path.display().to_string();
    };
    match file.strip_prefix(&folder) {
        Ok(below) => below.display().to_string().replace(MAIN_SEPARATOR, "/"),
        Err(_) => file.display().to_string(),
    }
}

/// `text` as a TOML string.
pub fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
