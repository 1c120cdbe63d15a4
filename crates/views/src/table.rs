//! Tables: what they hold, for text and page alike, and as columns that line up, without colour; numbers a person can
//! read; lines as wide as a terminal.

use store::ReportPlace;

/// Columns of an ordinary terminal, and of a page printed from it: no line is wider, single words apart.
pub const COLUMNS_MAX: usize = 80;
/// Columns that a text in a table's last column needs to be read; below that it goes on under its row.
const CELL_COLUMNS_MIN: usize = 20;

/// On which side a column lines up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Texts.
    Left,
    /// Numbers.
    Right,
}

/// What stands in one place of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words, or a figure.
    Plain(String),
    /// What a person types or copies: a key, a path, a fingerprint.
    Code(String),
    /// Words, and the key of a job that they are about, which a page shows beside them.
    Keyed(&'static str, &'static str),
    /// Words of which there is too little, which stand out on a page.
    Thin(String),
    /// A place, which a page links to its map.
    Place(ReportPlace),
    /// A figure, and the share of a whole that it says, which a page draws as a bar.
    Share(String, f64),
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self::Plain(text.into())
    }
}

impl Cell {
    /// A load module, or the south-western one of a window, is its row and column: the kind of limit says which.
    fn text(&self) -> String {
        match self {
            Self::Plain(text) | Self::Code(text) | Self::Thin(text) | Self::Share(text, _) => text.clone(),
            Self::Keyed(words, _) => (*words).to_owned(),
            Self::Place(ReportPlace::Module([row, col]) | ReportPlace::Window([row, col])) => format!("{row},{col}"),
            Self::Place(ReportPlace::Area) => "area".to_owned(),
        }
    }
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    pub head: String,
    pub align: Align,
    /// Whether a terminal has no room for it.
    pub is_for_page: bool,
}

/// How much of a long table is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Long {
    rows_of_text: usize,
    rows_of_page: usize,
    /// The file that has them all.
    file: &'static str,
}

/// Rows of cells, with a head where a column has one; each column is as wide as its widest cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    pub(crate) columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
    long: Option<Long>,
}

impl Table {
    /// A table without head and rows.
    pub fn new(columns: &[Align]) -> Self {
        columns.iter().fold(Self::default(), |table, &align| table.with([""], align, false))
    }

    /// The table with columns of words under these heads after those that it has.
    pub fn words<T: Into<String>>(self, heads: impl IntoIterator<Item = T>) -> Self {
        self.with(heads, Align::Left, false)
    }

    /// The same with columns of figures.
    pub fn figures<T: Into<String>>(self, heads: impl IntoIterator<Item = T>) -> Self {
        self.with(heads, Align::Right, false)
    }

    /// The same with columns of figures that only a page has room for.
    pub(crate) fn figures_of_page<const N: usize>(self, heads: [&str; N]) -> Self {
        self.with(heads, Align::Right, true)
    }

    fn with<T: Into<String>>(mut self, heads: impl IntoIterator<Item = T>, align: Align, is_for_page: bool) -> Self {
        let columns = heads.into_iter().map(|head| Column { head: head.into(), align, is_for_page });
        self.columns.extend(columns);
        self
    }

    /// The table of which a text and a page show so many rows; the rest is in `file`.
    pub(crate) fn long(self, [rows_of_text, rows_of_page]: [usize; 2], file: &'static str) -> Self {
        Self { long: Some(Long { rows_of_text, rows_of_page, file }), ..self }
    }

    /// Adds a row.
    ///
    /// # Panics
    /// When it has not one cell per column.
    pub fn row<T: Into<Cell>>(&mut self, cells: impl IntoIterator<Item = T>) {
        let cells: Vec<Cell> = cells.into_iter().map(Into::into).collect();
        assert_eq!(cells.len(), self.columns.len(), "a row has one cell per column");
        self.rows.push(cells);
    }

    /// Adds a row that begins with these cells and goes on with these figures.
    ///
    /// # Panics
    /// When it has not one cell per column.
    pub fn add<T: Into<Cell>, U: Into<Cell>>(
        &mut self,
        first: impl IntoIterator<Item = T>,
        figures: impl IntoIterator<Item = U>,
    ) {
        self.row(first.into_iter().map(Into::into).chain(figures.into_iter().map(Into::into)));
    }

    /// Whether no column has a head.
    fn is_headless(&self) -> bool {
        self.columns.iter().all(|column| column.head.is_empty())
    }

    /// Whether there is nothing to show.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Rows that a page shows, and what it says of the rest.
    pub(crate) fn of_page(&self) -> (&[Vec<Cell>], Option<String>) {
        self.shown(self.long.map(|long| long.rows_of_page))
    }

    fn shown(&self, rows_max: Option<usize>) -> (&[Vec<Cell>], Option<String>) {
        let shown = self.rows.len().min(rows_max.unwrap_or(usize::MAX));
        let rest = self.rows.len() - shown;
        let rest = self.long.filter(|_| 0 < rest).map(|Long { file, .. }| {
            let rest = grouped(rest as u64);
            format!("and {rest} more in {file}")
        });
        (&self.rows[..shown], rest)
    }

    /// The lines, each with `indent` spaces before it and none at its end. A text in the last column that would end
    /// beyond [`COLUMNS_MAX`] goes on below itself.
    pub fn text(&self, indent: usize) -> String {
        self.lines(indent, "")
    }

    /// The same with all rows two columns to the right of their head, as what stands below a title.
    pub(crate) fn text_below_head(&self) -> String {
        self.lines(0, "  ")
    }

    fn lines(&self, indent: usize, before_rows: &str) -> String {
        let columns = || self.columns.iter().enumerate().filter(|(_, column)| !column.is_for_page);
        let aligns: Vec<Align> = columns().map(|(_, column)| column.align).collect();
        let (shown, rest) = self.shown(self.long.map(|long| long.rows_of_text));
        let head = columns().map(|(_, column)| column.head.clone()).collect();
        let mut rows: Vec<Vec<String>> = Vec::from_iter((!self.is_headless()).then_some(head));
        for row in shown {
            let mut cells: Vec<String> = columns().map(|(index, _)| row[index].text()).collect();
            cells[0].insert_str(0, before_rows);
            rows.push(cells);
        }
        let mut text = lined_up(&aligns, &rows, indent);
        text.extend(rest.map(|rest| format!("{}{before_rows}{rest}\n", " ".repeat(indent))));
        text
    }
}

/// The lines of rows whose columns line up.
fn lined_up(aligns: &[Align], rows: &[Vec<String>], indent: usize) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..aligns.len()).map(width).collect();
    let before = indent + widths.iter().rev().skip(1).map(|width| width + 2).sum::<usize>();
    // Where the other columns leave too little, it is read under them.
    let hang = if before + CELL_COLUMNS_MIN <= COLUMNS_MAX { before } else { indent + 4 };
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(aligns).zip(&widths);
        let mut cells: Vec<String> = cells.map(|((cell, align), &width)| pad(cell, *align, width)).collect();
        let mut line = " ".repeat(indent);
        if aligns.last() == Some(&Align::Left)
            && let Some(last) = cells.pop()
        {
            line += &cells.iter().map(|cell| format!("{cell}  ")).collect::<String>();
            line = fill(line, last.trim_end(), hang);
        } else {
            line += &cells.join("  ");
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// `text` with every line that is wider than [`COLUMNS_MAX`] broken between words; what follows stands `hang` columns
/// to the right of where the line began. A word that is wider, such as a path, keeps its width.
pub fn fold(text: &str, hang: usize) -> String {
    let mut folded = String::with_capacity(text.len() + text.len() / 16);
    for line in text.split_inclusive('\n') {
        let (line, end) = line.strip_suffix('\n').map_or((line, ""), |line| (line, "\n"));
        if line.chars().count() <= COLUMNS_MAX {
            folded += line;
        } else {
            let words = line.trim_start_matches(' ');
            let indent = line.len() - words.len();
            folded += &fill(" ".repeat(indent), words, indent + hang);
        }
        folded += end;
    }
    folded
}

/// `begun` and the words of `text` after it, in lines as wide as may be; later ones begin after `hang` spaces.
fn fill(mut begun: String, text: &str, hang: usize) -> String {
    let mut columns = begun.chars().count();
    let mut is_first = true;
    for word in words(text) {
        let width = word.chars().count();
        let gap = usize::from(!is_first);
        // A word that is too wide for any line is no better on the next.
        if COLUMNS_MAX < columns + gap + width && hang < columns && hang + width <= COLUMNS_MAX {
            begun.truncate(begun.trim_end().len());
            begun += "\n";
            begun += &" ".repeat(hang);
            (columns, is_first) = (hang, true);
        }
        if !is_first {
            begun.push(' ');
            columns += 1;
        }
        begun += word;
        columns += width;
        // Spaces in a row are no words to begin a line with.
        is_first = width == 0 && columns == hang;
    }
    begun
}

/// The words of `text`, a number and its unit as one, so that no line begins with "m".
fn words(text: &str) -> Vec<&str> {
    const UNITS: [&str; 10] = ["m", "km", "s", "min", "h", "%", "kB", "MB", "GB", "posts"];
    let is_unit = |word: &str| UNITS.contains(&word.trim_end_matches([',', ';', ':', '.', ')']));
    let mut words: Vec<&str> = Vec::new();
    let mut start = 0;
    let mut follows_number = false;
    for word in text.split(' ') {
        let end = start + word.len();
        match words.last_mut() {
            // Both and the space between them.
            Some(number) if follows_number && is_unit(word) => *number = &text[start - 1 - number.len()..end],
            _ => words.push(word),
        }
        follows_number = word.ends_with(|c: char| c.is_ascii_digit());
        start = end + 1;
    }
    words
}

fn pad(cell: &str, align: Align, width: usize) -> String {
    match align {
        Align::Left => format!("{cell:<width$}"),
        Align::Right => format!("{cell:>width$}"),
    }
}

/// A whole number with a comma between thousands: 320,000.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (place, digit) in digits.chars().enumerate() {
        if 0 < place && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Figures with so many digits behind the point.
pub(crate) fn decimals<const N: usize>(all: [(f64, usize); N]) -> [String; N] {
    all.map(|(figure, digits)| format!("{figure:.digits$}"))
}

/// A share of a whole in per cent, with so many digits behind the point.
pub(crate) fn percent(part: f64, whole: f64, digits: usize) -> String {
    if 0.0 < whole { format!("{:.digits$}", 100.0 * part / whole) } else { "-".into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_set_apart() {
        for (number, expected) in [(0, "0"), (999, "999"), (1000, "1,000"), (320_000, "320,000")] {
            assert_eq!(grouped(number), expected);
        }
        assert_eq!(grouped(u64::MAX), "18,446,744,073,709,551,615");
    }

    #[test]
    fn a_wide_line_is_broken_between_words_and_a_wide_word_is_not() {
        let line = "error: ".to_owned() + &"word ".repeat(20) + "end";
        let folded = fold(&line, 2);
        assert_eq!(folded.split_whitespace().collect::<Vec<_>>(), line.split_whitespace().collect::<Vec<_>>());
        assert!(folded.lines().all(|line| line.chars().count() <= COLUMNS_MAX), "{folded}");
        assert_eq!(folded.lines().skip(1).filter(|line| !line.starts_with("  word")).count(), 0, "{folded}");
        let line = format!("{}reaches at 1.904 m: and more", "a word ".repeat(9));
        assert!(fold(&line, 2).ends_with("\n  1.904 m: and more"), "{}", fold(&line, 2));
        let path = "/a".repeat(60);
        assert_eq!(fold(&format!("error: {path}: found nothing there\n"), 2).lines().count(), 2);
        assert_eq!(fold("a  b\n\nc\n", 2), "a  b\n\nc\n");
    }

    #[test]
    fn a_wide_last_cell_goes_on_below_itself_or_where_there_is_room() {
        let mut table = Table::new(&[Align::Left, Align::Left]);
        table.row(["key", &"meaning ".repeat(20)]);
        let text = table.text(2);
        assert!(text.lines().skip(1).all(|line| line.starts_with("       meaning")), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= COLUMNS_MAX), "{text}");
        table.row(["k".repeat(70).as_str(), "x"]);
        let text = table.text(2);
        assert!(text.lines().skip(1).take(2).all(|line| line.starts_with("      meaning")), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= COLUMNS_MAX), "{text}");
    }

    #[test]
    fn numbers_line_up_at_their_last_digit_and_no_line_ends_in_a_space() {
        let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
        table.row(["é", "1", "x"]);
        table.row(["longer", "1,000", ""]);
        assert_eq!(table.text(1), " é           1  x\n longer  1,000\n");
    }
}
