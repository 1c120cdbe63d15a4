//! Well-known text as nodes inside nodes, whatever they mean.

/// Brackets inside brackets: the standard needs six.
const DEPTH_MAX: usize = 24;

/// `NAME["text", number, CHILD[…]]`.
#[derive(Debug, Default)]
pub(super) struct Node {
    pub keyword: String,
    pub texts: Vec<String>,
    pub numbers: Vec<f64>,
    pub children: Vec<Node>,
}

/// The EPSG code of the geographic system that a text describes, or that the system is projected from.
pub(super) fn geographic_code(text: &str) -> Option<u32> {
    let mut parser = Parser { rest: text, depth: 0 };
    let root = parser.node().ok()?;
    if root.keyword == "GEOGCS" { root.code() } else { root.child("GEOGCS")?.code() }
}

impl Node {
    pub fn child(&self, keyword: &str) -> Option<&Node> {
        self.children.iter().find(|node| node.keyword == keyword)
    }

    /// The vertical system: itself, or a part of it.
    pub fn vertical(&self) -> Option<&Node> {
        match self.keyword.as_str() {
            "VERT_CS" | "VERTCS" | "VERTCRS" | "VERTICALCRS" => Some(self),
            "COMPD_CS" | "COMPOUNDCRS" | "BOUNDCRS" | "SOURCECRS" => self.children.iter().find_map(Node::vertical),
            _ => None,
        }
    }

    pub fn unit(&self) -> Option<f64> {
        let node = self.child("UNIT").or_else(|| self.child("LENGTHUNIT"));
        node.and_then(|unit| unit.numbers.first().copied())
    }

    /// The EPSG code of this very node, not of a part of it.
    pub fn code(&self) -> Option<u32> {
        let mut named = self.children.iter().filter(|node| matches!(node.keyword.as_str(), "AUTHORITY" | "ID"));
        let node = named.find(|node| node.texts.first().is_some_and(|text| text.eq_ignore_ascii_case("EPSG")))?;
        let written = node.texts.get(1).and_then(|code| code.parse().ok());
        written.or_else(|| node.numbers.first().map(|&code| code as u32))
    }
}

/// What is left of a text.
pub(super) struct Parser<'a> {
    pub rest: &'a str,
    pub depth: usize,
}

impl Parser<'_> {
    pub fn node(&mut self) -> Result<Node, String> {
        self.depth += 1;
        if DEPTH_MAX < self.depth {
            return Err("text with too many brackets inside brackets".into());
        }
        let end = self.rest.find(['[', '(']).ok_or("text that is not well-known text")?;
        let keyword = self.rest[..end].trim().to_ascii_uppercase();
        if keyword.is_empty() || !keyword.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err("text that is not well-known text".into());
        }
        let mut node = Node { keyword, ..Node::default() };
        self.rest = &self.rest[end + 1..];
        loop {
            self.rest = self.rest.trim_start();
            match self.rest.chars().next() {
                Some(']' | ')') => {
                    self.rest = &self.rest[1..];
                    self.depth -= 1;
                    return Ok(node);
                }
                Some(',') => self.rest = &self.rest[1..],
                Some('"') => node.texts.push(self.quoted()?),
                Some(_) => self.value(&mut node)?,
                None => return Err("well-known text that ends too early".into()),
            }
        }
    }

    fn quoted(&mut self) -> Result<String, String> {
        let end = self.rest[1..].find('"').ok_or("well-known text with an open quotation mark")?;
        let text = self.rest[1..=end].to_owned();
        self.rest = &self.rest[end + 2..];
        Ok(text)
    }

    /// A number, a bare word, or a node.
    fn value(&mut self, node: &mut Node) -> Result<(), String> {
        let end = self.rest.find([',', ']', ')', '[', '(']).ok_or("well-known text that ends too early")?;
        if self.rest[end..].starts_with(['[', '(']) {
            node.children.push(self.node()?);
            return Ok(());
        }
        if let Ok(number) = self.rest[..end].trim().parse::<f64>() {
            node.numbers.push(number);
        }
        self.rest = &self.rest[end..];
        Ok(())
    }
}
