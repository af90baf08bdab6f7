//! The page of a sweep: one HTML file with everything in it, verdicts first, plots as inline SVG and pictures as base64, that loads nothing from
//! anywhere.

use std::fmt::Write as _;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use clerestory::Result;
use clerestory::film::png::Rgb8;

use super::findings::{Findings, Headline};
use super::plot::{self, Curve, PlotPoint, Words};
use super::results::Results;
use super::series::{SceneSeries, Series, SeriesPoint, Work};
use super::strip::{self, Strip};
use super::summary;
use super::table::{Cell, Table};

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;max-width:1240px;margin:2em auto;padding:0 1em;color:#111;background:#fff}\
h1{font-size:1.5em}h2{font-size:1.2em;margin-top:2em;border-bottom:1px solid #ccc}h3{font-size:1em}\
table{border-collapse:collapse;font-size:13px;margin:1em 0;display:block;overflow-x:auto}\
th,td{padding:.2em .6em;border-bottom:1px solid #ddd;text-align:right;white-space:nowrap}\
th{border-bottom:2px solid #888;vertical-align:bottom;white-space:normal}th.w,td.w{text-align:left}\
.plots{display:flex;flex-wrap:wrap;gap:1em}.plots svg{max-width:100%;height:auto}\
.strip td,.strip th{border:0;text-align:center;white-space:normal;max-width:16em}.strip img{image-rendering:pixelated;min-width:160px}\
p.note,figcaption{font-size:13px;color:#444}";

/// Text as HTML.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// Text with Markdown's back-quotes and double stars as HTML.
fn inline(text: &str) -> String {
    let mut out = escaped(text);
    for (mark, begin, end) in [("**", "<b>", "</b>"), ("`", "<code>", "</code>")] {
        let parts: Vec<&str> = out.split(mark).collect();
        if parts.len() % 2 == 1 {
            let tags = [begin, end].into_iter().cycle().take(parts.len() - 1).chain([""]);
            out = parts
                .iter()
                .zip(tags)
                .map(|(part, tag)| format!("{part}{tag}"))
                .collect();
        }
    }
    out
}

fn table_html(table: &Table) -> String {
    let words: Vec<bool> = (0..table.heads.len())
        .map(|column| {
            let mut cells = table.rows.iter().filter_map(|row| row.get(column));
            cells.all(|cell| matches!(cell, Cell::Text(_)))
        })
        .collect();
    let cell = |tag: &str, column: usize, text: &str| {
        let class = if words.get(column) == Some(&true) {
            " class=\"w\""
        } else {
            ""
        };
        format!("<{tag}{class}>{}</{tag}>", inline(text))
    };
    let heads: String = table
        .heads
        .iter()
        .enumerate()
        .map(|(i, head)| cell("th", i, head))
        .collect();
    let mut html = format!("<table><thead><tr>{heads}</tr></thead><tbody>\n");
    for row in &table.rows {
        let cells: String = row
            .iter()
            .enumerate()
            .map(|(i, one)| cell("td", i, &one.to_string()))
            .collect();
        html += &format!("<tr>{cells}</tr>\n");
    }
    html += "</tbody></table>\n";
    for note in &table.notes {
        html += &format!("<p class=\"note\">{}</p>\n", inline(note));
    }
    html
}

/// What plots of sweeps show on the axis of errors.
pub const ERROR: &str = "relative RMSE";

/// A scene's errors against some work, a curve for each variant.
pub fn curves_of(scene: &SceneSeries, work: Work) -> Vec<Curve> {
    let point = |point: &SeriesPoint| PlotPoint {
        x: point.work(work),
        y: point.relative_rmse,
        y_range: point.relative_rmse_range,
        ringed: work == Work::Seconds && point.on_front,
    };
    let curve = |series: &Series| Curve {
        name: series.name.clone(),
        points: series.points.iter().map(point).collect(),
    };
    scene.series.iter().map(curve).collect()
}

/// The plot of a scene's errors against some work; `None` without points.
///
/// # Errors
/// As [`plot::log_log`].
pub fn plot_of(scene: &SceneSeries, work: Work) -> Result<Option<String>> {
    let words = Words {
        title: &scene.address,
        x: work.label(),
        y: ERROR,
    };
    plot::log_log(words, &curves_of(scene, work))
}

/// Verdicts, then the one number.
fn verdicts_html(findings: &Findings) -> String {
    let mut html = String::new();
    if !findings.verdicts.is_empty() {
        let verdicts = findings.verdicts.iter();
        let items: String = verdicts
            .map(|judged| format!("<li>{}</li>\n", inline(&judged.to_string())))
            .collect();
        html += &format!("<ul class=\"verdicts\">\n{items}</ul>\n");
    }
    if let Some(Headline { words, found }) = &findings.headline {
        html += &format!(
            "<p>In one number: {}: <b>{}</b>.</p>\n",
            inline(words),
            Cell::from(*found)
        );
    }
    html
}

fn picture(of: &Rgb8, alt: &str) -> Result<String> {
    let bytes = strip::png_bytes(of, Path::new(alt))?;
    Ok(format!(
        "<img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\">",
        escaped(alt),
        of.width,
        of.height,
        STANDARD.encode(bytes)
    ))
}

fn strip_html(strip: &Strip) -> Result<String> {
    let mut rows = [
        format!(
            "<th>reference</th>{}",
            strip
                .columns
                .iter()
                .map(|c| format!("<th>{}</th>", escaped(&c.name)))
                .collect::<String>()
        ),
        format!("<td>{}</td>", picture(&strip.reference, "reference")?),
        format!(
            "<td>difference: red too bright, blue too dark; full colour is {:.3e}</td>",
            strip.full_scale
        ),
        "<td>FLIP error: black 0, white 1</td>".to_owned(),
    ];
    for column in &strip.columns {
        let pictures = [&column.picture, &column.difference, &column.flip];
        for (row, (one, what)) in
            rows[1..]
                .iter_mut()
                .zip(pictures.into_iter().zip(["picture", "difference", "FLIP error"]))
        {
            *row += &format!("<td>{}</td>", picture(one, &format!("{}: {what}", column.name))?);
        }
    }
    let rows: String = rows.iter().map(|row| format!("<tr>{row}</tr>\n")).collect();
    Ok(format!("<table class=\"strip\">{rows}</table>\n"))
}

/// The whole page. `strips` are those of the scenes, in order, where pictures are there.
///
/// # Errors
/// [`clerestory::Error::Picture`] or [`clerestory::Error::Io`] for a picture or plot that cannot be made.
pub fn html(
    results: &Results,
    scenes: &[SceneSeries],
    findings: &Findings,
    strips: &[Option<Strip>],
) -> Result<String> {
    let title = format!("{}: {}", results.experiment, results.title);
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\n<style>{STYLE}</style></head><body>\n<h1>{0}</h1>\n{1}<p>{2}</p>\n<ul>\n",
        escaped(&title),
        verdicts_html(findings),
        inline(&results.about)
    );
    for fact in summary::facts(results) {
        // Writing to a string cannot fail.
        let _ = writeln!(page, "<li>{}</li>", inline(&fact));
    }
    let _ = writeln!(
        page,
        "<li>Measures: {}.</li>\n</ul>",
        escaped(&results.systems.join(", "))
    );
    let overview = summary::overview(scenes);
    let _ = write!(page, "<h2>{}</h2>\n{}", escaped(&overview.title), table_html(&overview));
    for (index, scene) in scenes.iter().enumerate() {
        let budgets = summary::budgets(scene);
        let _ = write!(page, "<h2>{}</h2>\n<div class=\"plots\">\n", inline(&budgets.title));
        for work in Work::ALL {
            page += &plot_of(scene, work)?.unwrap_or_default();
        }
        page += "</div>\n<p class=\"note\">Bars span the least and greatest of the repeats; rings mark the Pareto front of time and error.</p>\n";
        if let Some(Some(strip)) = strips.get(index) {
            page += &strip_html(strip)?;
        }
        page += &table_html(&budgets);
    }
    page += "</body></html>\n";
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::super::findings::{self, Bound, Measured};
    use super::super::series;
    use super::super::summary::tests::made_up_results;
    use super::*;

    #[test]
    fn the_page_holds_everything_and_loads_nothing() {
        let results = made_up_results();
        let scenes = series::of(&results);
        let strips: Vec<Option<Strip>> = results.scenes.iter().map(|scene| strip::of(scene).unwrap()).collect();
        let verdicts = vec![findings::judge(
            "faster, <always>",
            Bound::AtLeast(1.0),
            "",
            [("`ring`".to_owned(), Measured::exact(0.5))],
        )];
        let findings = Findings {
            verdicts,
            ..Findings::default()
        }
        .headline("a & b", Some(Measured::exact(2.0)));
        let page = html(&results, &scenes, &findings, &strips).unwrap();
        let verdict = page.find("<li><b>fails</b> by 0.5000: faster, &lt;always&gt;").unwrap();
        assert!(verdict < page.find("<p>Compares").unwrap());
        assert!(page.contains("In one number: a &amp; b: <b>2.000</b>."));
        assert_eq!(page.matches("<svg").count(), 3);
        assert_eq!(page.matches("data:image/png;base64,").count(), 1 + 2 * 3);
        assert!(
            page.contains("Numbers &lt;without&gt; pictures") && page.contains("&lt;fast&gt; &amp; &quot;good&quot;")
        );
        assert!(page.contains("<p>Compares &lt;nothing&gt; with nothing.</p>"));
        assert!(page.contains("<b>Smoke run</b>") && page.contains("<code>builtin:ring</code>"));
        assert_eq!(
            page.matches("http").count(),
            page.matches("http://www.w3.org/2000/svg").count()
        );
        for tag in ["<script", "<link", "url(", "@import"] {
            assert!(!page.contains(tag), "{tag}");
        }
        assert_eq!(page.matches("src=").count(), page.matches("src=\"data:").count());
        for tag in ["table", "tr", "td", "th", "svg", "div"] {
            let opened = page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count();
            assert_eq!(opened, page.matches(&format!("</{tag}>")).count(), "{tag}");
        }
    }

    #[test]
    fn marks_become_tags_and_nothing_else_does() {
        assert_eq!(inline("**a** `b<c>`"), "<b>a</b> <code>b&lt;c&gt;</code>");
        assert_eq!(inline("2 ` 3"), "2 ` 3");
    }
}
