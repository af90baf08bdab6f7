//! Legends of plots: the names of curves in a column of their own beside the frame, never over it.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::plot::{FONT, Glyph, LEGEND_LINE};

/// A curve's name and looks.
#[derive(Debug, Clone)]
pub struct Entry<'a> {
    /// Its name; long ones take several lines.
    pub name: &'a str,
    /// Of line and marker.
    pub color: RGBColor,
    /// Dash and gap of the line.
    pub dash: (u32, u32),
    /// Which marker.
    pub shape: Option<usize>,
}

/// Pixels across.
pub const WIDTH: u32 = 210;
/// From the top of the picture, below the height of a caption.
const TOP: i32 = 50;
const BOTTOM: i32 = 10;
/// From the line to the name.
const GAP: i32 = 8;
const LETTERS: i32 = 13;
const ROW: i32 = 16;
const BETWEEN: i32 = 6;
/// Letters that fit on a line: seven pixels each is more than the mean of usual fonts of that size.
const LETTERS_OF_A_LINE: usize = (WIDTH as usize - LEGEND_LINE as usize - GAP as usize) / 7;

/// Lines of whole words, of which one is longer than a line only where a word is.
fn lines(name: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in name.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= LETTERS_OF_A_LINE => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Pixels from the top of the picture to the end of the legend.
pub fn height(entries: &[Entry<'_>]) -> u32 {
    let rows = entries
        .iter()
        .map(|entry| ROW * lines(entry.name).len() as i32 + BETWEEN);
    (TOP + rows.sum::<i32>() + BOTTOM) as u32
}

/// Draws the names from above, each with a piece of its line and its marker.
///
/// # Errors
/// The cause when it cannot be drawn.
pub fn draw<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, entries: &[Entry<'_>]) -> Result<(), String> {
    let failed = |cause: &dyn std::fmt::Display| cause.to_string();
    let style = (FONT, LETTERS)
        .into_font()
        .color(&BLACK)
        .pos(Pos::new(HPos::Left, VPos::Center));
    let mut y = TOP;
    for entry in entries {
        let glyph = Glyph {
            points: vec![(0, y)],
            shape: entry.shape,
            legend: Some(entry.dash),
            color: entry.color,
        };
        area.draw(&glyph).map_err(|e| failed(&e))?;
        for line in lines(entry.name) {
            let text = Text::new(line, (LEGEND_LINE + GAP, y), style.clone());
            area.draw(&text).map_err(|e| failed(&e))?;
            y += ROW;
        }
        y += BETWEEN;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_take_several_lines_and_lose_no_word() {
        let name = "fixed kernels of four times the radius, never smaller";
        let found = lines(name);
        assert!(found.len() > 1 && found.iter().all(|line| line.chars().count() <= LETTERS_OF_A_LINE));
        assert_eq!(found.join(" "), name);
        assert_eq!(lines("short"), ["short"]);
        let entry = |name| Entry {
            name,
            color: BLACK,
            dash: (1, 0),
            shape: None,
        };
        assert_eq!(height(&[entry("short")]), height(&[]) + (ROW + BETWEEN) as u32);
        assert!(height(&[entry(name)]) > height(&[entry("short")]));
    }
}
