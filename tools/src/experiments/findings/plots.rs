//! Plots and pictures of a page: what they show of rows, drawn when the page is written.

use clerestory::Result;

use super::Measured;
use crate::experiments::bars::{self, Bar, Group};
use crate::experiments::lines::{self, Line};
use crate::experiments::plot::{self, Curve, PlotPoint, Words};
use crate::experiments::table::Cell;

/// A plot or a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Its file, beside the page.
    pub file: String,
    /// What it shows.
    pub words: String,
    content: Content,
}

#[derive(Debug, Clone, PartialEq)]
enum Content {
    Curves(Axes, Vec<Curve>),
    Bars(Vec<String>, Vec<Group>),
    Svg(String),
    File,
}

/// A part of stacked bars: its name and its length in a row.
pub type Part<'a, R> = (&'a str, fn(&R) -> f64);

/// Axes of curves, each named with its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    x: &'static str,
    y: &'static str,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Falling,
    Rates,
    Even { top: f64, steps: (u32, f64) },
}

impl Axes {
    /// Logarithmic, with a guide of the slope −½: errors against work.
    pub const fn falling(x: &'static str, y: &'static str) -> Self {
        let kind = Kind::Falling;
        Self { x, y, kind }
    }

    /// Logarithmic, without a guide.
    pub const fn rates(x: &'static str, y: &'static str) -> Self {
        let kind = Kind::Rates;
        Self { x, y, kind }
    }

    /// Linear: up to `top`, and so many steps of so much to the right.
    pub const fn even(x: &'static str, y: &'static str, top: f64, steps: (u32, f64)) -> Self {
        let kind = Kind::Even { top, steps };
        Self { x, y, kind }
    }
}

/// Points of rows by the names of their curves, both in the order in which they appear.
pub fn curves<R>(rows: &[R], name: impl Fn(&R) -> String, at: impl Fn(&R) -> (f64, Measured)) -> Vec<Curve> {
    let mut all: Vec<Curve> = Vec::new();
    for row in rows {
        let (x, Measured { value, low, high }) = at(row);
        let point = PlotPoint {
            x,
            y: value,
            y_range: [low, high].map(|end| if end.is_finite() { end } else { value }),
            ringed: false,
        };
        let name = name(row);
        match all.iter_mut().find(|curve| curve.name == name) {
            Some(curve) => curve.points.push(point),
            None => all.push(Curve {
                name,
                points: vec![point],
            }),
        }
    }
    all
}

impl Plot {
    pub(super) fn curves(name: &str, title: &str, axes: Axes, curves: Vec<Curve>) -> Self {
        Self::new(format!("{name}.svg"), title, Content::Curves(axes, curves))
    }

    /// A bar for each row, in groups.
    pub(super) fn bars<R>(
        name: &str,
        title: &str,
        rows: &[R],
        names: impl Fn(&R) -> [String; 2],
        of: impl Fn(&R) -> Measured,
    ) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        for row in rows {
            let ([head, name], found) = (names(row), of(row));
            let row = bars::Row {
                name,
                bars: vec![Bar {
                    parts: vec![(0, found.value)],
                    range: (!found.is_exact() && found.low.is_finite() && found.high.is_finite())
                        .then_some([found.low, found.high]),
                    figure: Cell::from(found.value).to_string(),
                }],
            };
            match groups.iter_mut().find(|group| group.head == head) {
                Some(group) => group.rows.push(row),
                None => groups.push(Group { head, rows: vec![row] }),
            }
        }
        Self::new(format!("{name}.svg"), title, Content::Bars(Vec::new(), groups))
    }

    /// A bar for each row, in parts.
    pub(super) fn stacked_bars<R>(
        name: &str,
        title: &str,
        rows: &[R],
        names: impl Fn(&R) -> String,
        parts: &[Part<'_, R>],
    ) -> Self {
        let bar = |row: &R| {
            let values: Vec<(usize, f64)> = parts.iter().map(|(_, of)| of(row)).enumerate().collect();
            let sum: f64 = values.iter().map(|(_, value)| value).sum();
            bars::Row {
                name: names(row),
                bars: vec![Bar {
                    parts: values,
                    range: None,
                    figure: Cell::from(sum).to_string(),
                }],
            }
        };
        let groups = vec![Group {
            head: String::new(),
            rows: rows.iter().map(bar).collect(),
        }];
        let legend = parts.iter().map(|(word, _)| (*word).to_owned()).collect();
        Self::new(format!("{name}.svg"), title, Content::Bars(legend, groups))
    }

    pub(super) fn drawing(file: &str, title: &str, svg: String) -> Self {
        Self::new(file.into(), title, Content::Svg(svg))
    }

    pub(super) fn picture(file: &str, words: &str) -> Self {
        Self::new(file.into(), words, Content::File)
    }

    fn new(file: String, words: &str, content: Content) -> Self {
        Self {
            file,
            words: words.into(),
            content,
        }
    }

    /// The drawing as SVG; `None` of a file that the run itself wrote, and where there is nothing to draw.
    ///
    /// # Errors
    /// [`clerestory::Error::Io`] when it cannot be drawn.
    pub fn svg(&self) -> Result<Option<String>> {
        match &self.content {
            Content::Curves(axes, curves) => axes.draw(&self.words, curves),
            Content::Bars(legend, groups) => {
                let legend: Vec<&str> = legend.iter().map(String::as_str).collect();
                bars::draw(&self.words, &legend, groups)
            }
            Content::Svg(svg) => Ok(Some(svg.clone())),
            Content::File => Ok(None),
        }
    }

    /// Whether the run itself wrote its file.
    pub fn is_file(&self) -> bool {
        self.content == Content::File
    }
}

impl Axes {
    fn draw(&self, title: &str, curves: &[Curve]) -> Result<Option<String>> {
        let Self { x, y, kind } = *self;
        let words = Words { title, x, y };
        match kind {
            Kind::Falling => plot::log_log(words, curves),
            Kind::Rates => plot::log_log_of_rates(words, curves),
            Kind::Even { .. } if curves.is_empty() => Ok(None),
            Kind::Even { top, steps } => {
                let lines: Vec<Line> = curves
                    .iter()
                    .map(|curve| Line {
                        name: curve.name.clone(),
                        points: curve.points.iter().map(|point| (point.x, point.y)).collect(),
                    })
                    .collect();
                lines::draw(words, steps, top, &lines).map(Some)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Point = (&'static str, f64, f64);

    fn points() -> Vec<Point> {
        vec![("b", 1.0, 4.0), ("a", 1.0, 2.0), ("b", 4.0, 2.0)]
    }

    #[test]
    fn curves_are_in_the_order_of_rows() {
        let curves = curves(&points(), |row| row.0.into(), |row| (row.1, row.2.into()));
        let names: Vec<&str> = curves.iter().map(|curve| curve.name.as_str()).collect();
        assert_eq!((names, curves[0].points.len()), (vec!["b", "a"], 2));
        for axes in [
            Axes::falling("x", "y"),
            Axes::rates("x", "y"),
            Axes::even("x", "y", 5.0, (4, 1.0)),
        ] {
            let svg = Plot::curves("name", "title", axes, curves.clone())
                .svg()
                .unwrap()
                .unwrap();
            assert!(svg.contains("title") && !svg.contains("NaN"), "{svg}");
            assert_eq!(Plot::curves("name", "title", axes, Vec::new()).svg().unwrap(), None);
        }
    }

    #[test]
    fn bars_stand_in_groups_and_parts() {
        let of = |row: &Point| Measured::within(row.2, 0.5);
        let plot = Plot::bars("name", "title", &points(), |row| [row.0.into(), "bar".into()], of);
        assert_eq!(plot.file, "name.svg");
        assert!(plot.svg().unwrap().unwrap().contains("bar"));
        let parts: [Part<'_, Point>; 2] = [("first", |row| row.1), ("second", |row| row.2)];
        let plot = Plot::stacked_bars("name", "title", &points(), |row| row.0.into(), &parts);
        let svg = plot.svg().unwrap().unwrap();
        assert!(svg.contains("first") && svg.contains("second"), "{svg}");
        assert!(Plot::picture("a.png", "words").is_file());
    }
}
