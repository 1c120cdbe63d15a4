//! The tile board: one character per tile, north on top, as it stands in the current stage.

use build::Event;
use terrain::TileId;

/// What the characters mean, for a person who looks at the board for the first time.
pub const LEGEND: &str = ". waiting  o running  # done  = kept";

/// How far each tile is in the current stage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Board {
    rows: u32,
    columns: u32,
    marks: Vec<char>,
}

impl Board {
    /// All tiles waiting.
    pub fn new(rows: u32, columns: u32) -> Self {
        Self { rows, columns, marks: vec!['.'; rows as usize * columns as usize] }
    }

    /// Takes note of what happened; a stage that goes by tiles begins with all of them waiting.
    pub fn hear(&mut self, event: &Event) {
        match event {
            Event::Enter(_, tiles) if 0 < *tiles => self.marks.fill('.'),
            Event::Started(_, tile) => self.mark(*tile, 'o'),
            Event::Done(_, tile) => self.mark(*tile, '#'),
            Event::Kept(_, tile) => self.mark(*tile, '='),
            _ => {}
        }
    }

    /// Sets the character of a tile; one that is not on the board is left out.
    pub fn mark(&mut self, tile: TileId, mark: char) {
        if tile.row < self.rows && tile.col < self.columns {
            self.marks[tile.row as usize * self.columns as usize + tile.col as usize] = mark;
        }
    }

    /// One line per row of tiles, the northern one first, a space between tiles.
    pub fn lines(&self) -> Vec<String> {
        let rows = self.marks.chunks(self.columns as usize).rev();
        rows.map(|row| row.iter().map(char::to_string).collect::<Vec<_>>().join(" ")).collect()
    }

    /// The board with a character for each square of so many tiles a side, counted from the south-west: the first of
    /// `order` that one of them has.
    pub fn coarser(&self, side: u32, order: &[char]) -> Self {
        let (rows, columns) = (self.rows.div_ceil(side), self.columns.div_ceil(side));
        let rank = |mark: char| order.iter().position(|&known| known == mark).unwrap_or(order.len());
        let mut coarse = Self::new(rows, columns);
        coarse.marks.fill(' ');
        for (place, &mark) in self.marks.iter().enumerate() {
            let (row, col) = (place / self.columns as usize, place % self.columns as usize);
            let into = &mut coarse.marks[row / side as usize * columns as usize + col / side as usize];
            if *into == ' ' || rank(mark) < rank(*into) {
                *into = mark;
            }
        }
        coarse
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use build::Stage;

    #[test]
    fn the_north_is_on_top_and_a_new_stage_wipes_the_board() {
        let mut board = Board::new(2, 3);
        let tile = |row, col| TileId { row, col };
        for event in [
            Event::Enter(Stage::Refine, 6),
            Event::Kept(Stage::Refine, tile(0, 0)),
            Event::Started(Stage::Refine, tile(0, 1)),
            Event::Started(Stage::Refine, tile(1, 2)),
            Event::Done(Stage::Refine, tile(1, 2)),
            Event::Done(Stage::Refine, tile(7, 7)),
        ] {
            board.hear(&event);
        }
        assert_eq!(board.lines(), [". . #", "= o ."]);
        board.hear(&Event::Enter(Stage::Publish, 0));
        assert_eq!(board.lines(), [". . #", "= o ."]);
        board.hear(&Event::Enter(Stage::Assemble, 6));
        assert_eq!(board.lines(), [". . .", ". . ."]);
    }

    #[test]
    fn a_coarser_board_shows_the_mark_that_matters_most_in_each_square() {
        let mut board = Board::new(3, 4);
        for (row, col, mark) in [(0, 0, '#'), (1, 1, '!'), (0, 2, '#'), (1, 2, '#'), (0, 3, '#'), (1, 3, '#')] {
            board.mark(TileId { row, col }, mark);
        }
        assert_eq!(board.coarser(2, &['!', '.', '#']).lines(), [". .", "! #"]);
    }
}
