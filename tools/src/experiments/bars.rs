//! Bar charts as SVG: rows in groups, a bar a row or several, a bar in one part or several.
//!
//! Legible in black and white: parts differ in lightness, and each bar has its figure at its end. Colours are of the eight of Okabe and Ito
//! (*Color Universal Design*, 2008).

use clerestory::{Error, Result};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A bar.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Parts from left to right: which word of the legend, and how long.
    pub parts: Vec<(usize, f64)>,
    /// Ends of a whisker.
    pub range: Option<[f64; 2]>,
    /// The figure at its end.
    pub figure: String,
}

/// Bars under one name.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Stands to the left.
    pub name: String,
    /// From above.
    pub bars: Vec<Bar>,
}

/// Rows under one head, with a scale of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Stands above.
    pub head: String,
    /// From above.
    pub rows: Vec<Row>,
}

const FONT: &str = "sans-serif";
const WIDTH: i32 = 760;
const NAMES: i32 = 190;
const FIGURES: i32 = 96;
const TITLE: i32 = 30;
const LEGEND: i32 = 26;
const HEAD: i32 = 28;
const BAR: i32 = 11;
const GAP: i32 = 7;
const COLORS: [RGBColor; 5] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(214, 214, 214),
    RGBColor(110, 110, 110),
    RGBColor(0, 158, 115),
];

fn height(group: &Group) -> i32 {
    let rows = group.rows.iter().map(|row| BAR * row.bars.len() as i32 + GAP);
    HEAD + rows.sum::<i32>()
}

/// The greatest end of a bar or whisker, which takes the whole width.
fn reach(group: &Group) -> f64 {
    let bars = group.rows.iter().flat_map(|row| &row.bars);
    let ends = bars.map(|bar| {
        let end: f64 = bar.parts.iter().map(|part| part.1).sum();
        end.max(bar.range.map_or(0.0, |range| range[1]))
    });
    ends.filter(|end| end.is_finite()).fold(0.0, f64::max)
}

/// Draws them; `None` when no group has a bar that is longer than nothing.
///
/// # Errors
/// [`Error::Io`] when it cannot be drawn.
pub fn draw(title: &str, legend: &[&str], groups: &[Group]) -> Result<Option<String>> {
    let groups: Vec<&Group> = groups.iter().filter(|group| reach(group) > 0.0).collect();
    if groups.is_empty() {
        return Ok(None);
    }
    let mut svg = String::new();
    onto(&mut svg, title, legend, &groups).map_err(|cause| Error::io(title, std::io::Error::other(cause)))?;
    Ok(Some(svg))
}

fn onto(svg: &mut String, title: &str, legend: &[&str], groups: &[&Group]) -> std::result::Result<(), String> {
    let failed = |cause: &dyn std::fmt::Display| cause.to_string();
    let total = TITLE + LEGEND + groups.iter().map(|group| height(group)).sum::<i32>() + GAP;
    let root = SVGBackend::with_string(svg, (WIDTH as u32, total as u32)).into_drawing_area();
    root.fill(&WHITE).map_err(|e| failed(&e))?;
    let style = |size: i32, across: HPos| {
        (FONT, size)
            .into_font()
            .color(&BLACK)
            .pos(Pos::new(across, VPos::Center))
    };
    let write = |text: &str, place: (i32, i32), size: i32, across: HPos| {
        root.draw(&Text::new(text.to_owned(), place, style(size, across)))
            .map_err(|e| failed(&e))
    };
    let fill = |from: (i32, i32), to: (i32, i32), part: usize| {
        root.draw(&Rectangle::new([from, to], COLORS[part % COLORS.len()].filled()))
            .map_err(|e| failed(&e))
    };
    write(title, (WIDTH / 2, TITLE / 2), 15, HPos::Center)?;
    let (mut x, y) = (NAMES, TITLE + LEGEND / 2);
    for (part, word) in legend.iter().enumerate() {
        fill((x, y - BAR / 2), (x + BAR, y + BAR / 2), part)?;
        write(word, (x + BAR + 5, y), 13, HPos::Left)?;
        // About the width of the word.
        x += BAR + 24 + 7 * word.chars().count() as i32;
    }
    let mut top = TITLE + LEGEND;
    for group in groups {
        let scale = f64::from(WIDTH - NAMES - FIGURES) / reach(group);
        let at = |value: f64| NAMES + (scale * value).round() as i32;
        write(&group.head, (8, top + HEAD / 2), 13, HPos::Left)?;
        let mut y = top + HEAD;
        for row in &group.rows {
            let bars = row.bars.len() as i32;
            write(&row.name, (NAMES - 8, y + BAR * bars / 2), 12, HPos::Right)?;
            for bar in &row.bars {
                let mut end = 0.0;
                for (part, length) in bar.parts.iter().filter(|(_, length)| *length > 0.0) {
                    fill((at(end), y), (at(end + length), y + BAR - 1), *part)?;
                    end += length;
                }
                if let Some([low, high]) = bar.range {
                    let middle = y + BAR / 2;
                    let whisker = PathElement::new([(at(low), middle), (at(high), middle)], BLACK.stroke_width(1));
                    root.draw(&whisker).map_err(|e| failed(&e))?;
                    end = end.max(high);
                }
                write(&bar.figure, (at(end) + 5, y + BAR / 2), 11, HPos::Left)?;
                y += BAR;
            }
            y += GAP;
        }
        top = y;
    }
    root.present().map_err(|e| failed(&e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_has_its_words_and_is_sound_xml() {
        let bar = |length: f64| Bar {
            parts: vec![(0, length), (1, 0.5)],
            range: Some([0.9 * length, 1.1 * length + 0.5]),
            figure: format!("{length} <"),
        };
        let group = |head: &str, lengths: &[f64]| Group {
            head: head.into(),
            rows: vec![Row {
                name: "a & b".into(),
                bars: lengths.iter().copied().map(bar).collect(),
            }],
        };
        let groups = [group("first", &[1.0, 2.0]), group("second", &[3.0])];
        let svg = draw("bars", &["one", "two"], &groups).unwrap().unwrap();
        for word in ["bars", "one", "two", "a &amp; b", "first", "second", "3 &lt;"] {
            assert!(svg.contains(word), "{word}: {svg}");
        }
        assert!(svg.trim_start().starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert_eq!(draw("none", &[], &[]).unwrap(), None);
        let empty = Group {
            head: "empty".into(),
            rows: Vec::new(),
        };
        assert_eq!(draw("none", &[], &[empty]).unwrap(), None);
    }
}
