//! `clerestory list`: the techniques and the catalogue of the engine's systems, with where code, kernels, settings, tests and results of each
//! are; by id, by words, as JSON and as pages.

mod pages;
mod results;
mod search;

use std::process::ExitCode;

use clap::Args;
use clerestory::catalogue::{self, Cite, PREFIXES, Role, Row};
use clerestory::settings::SettingInfo;
use clerestory::techniques::{self, Bias, Card};

use crate::failure::{Failure, Outcome};
use crate::output::{self, Table};
use results::Page;

/// Lists the techniques and the catalogue of systems: what they cannot do, and where code, kernels, settings, tests and results are
#[derive(Debug, Args)]
#[command(after_help = after_help())]
pub struct Arguments {
    /// Only this technique or system, by its id, or those with all of these words in their descriptions, files, kernels and public paths
    #[arg(value_name = "ID OR WORDS")]
    words: Vec<String>,
    /// Prints JSON
    #[arg(long)]
    json: bool,
    /// Prints the catalogue as a page of Markdown
    #[arg(long, conflicts_with_all = ["words", "json"])]
    markdown: bool,
    /// Prints the sources that the catalogue cites, as a page of Markdown
    #[arg(long, conflicts_with_all = ["words", "json", "markdown"])]
    sources: bool,
}

fn after_help() -> String {
    let prefixes = PREFIXES
        .iter()
        .map(|(prefix, follows)| format!("\n  {prefix:<5} {follows}"));
    format!(
        "\
Examples:
  clerestory list
  clerestory list BG-3                 one system, with its sources, code, shaders, tests and results
  clerestory list path                 one technique, with the meaning, range, unit and default of each setting
  clerestory list photon mapping       systems found by words
  clerestory list --markdown > docs/catalogue.md
  clerestory list --sources > third_party_notes/sources.md
  clerestory list --json | jq '.techniques[].default_settings'
  clerestory render --technique path --settings '{{\"roulette_start\": 8}}'

Ids begin with what they follow:{}",
        prefixes.collect::<String>()
    )
}

/// A row with what measures it.
#[derive(serde::Serialize)]
struct System {
    #[serde(flatten)]
    row: &'static Row,
    /// Commands that measure it.
    measured_by: Vec<String>,
    /// The pages that hold it.
    results: Vec<Page>,
    /// The technique that it is.
    #[serde(skip)]
    card: Option<&'static Card>,
}

impl From<&'static Row> for System {
    fn from(row: &'static Row) -> Self {
        let measured_by = results::commands(row);
        Self {
            row,
            results: results::pages(&measured_by),
            measured_by,
            card: card_of(row),
        }
    }
}

/// The technique whose own row this is.
fn card_of(row: &Row) -> Option<&'static Card> {
    let mut cards = techniques::all().iter();
    cards.find(|card| catalogue::row_of(card).is_some_and(|own| own.id == row.id))
}

/// A technique as it is printed as JSON.
#[derive(serde::Serialize)]
struct Technique {
    id: &'static str,
    summary: &'static str,
    path_set: String,
    bias: Bias,
    needs: &'static [&'static str],
    /// Its row of the catalogue; that of its code, tests and so on.
    row: Option<&'static Row>,
    /// The folder of its code.
    code: &'static str,
    /// The pages of what measures it.
    results: Vec<Page>,
    settings: Vec<SettingInfo>,
    default_settings: serde_json::Value,
}

impl From<&'static Card> for Technique {
    fn from(card: &'static Card) -> Self {
        let row = catalogue::row_of(card);
        let results = row.map(|row| System::from(row).results).unwrap_or_default();
        Self {
            id: card.id,
            summary: card.summary,
            path_set: card.path_set.to_string(),
            bias: card.bias,
            needs: card.needs,
            row,
            code: row.map_or("", folder),
            results,
            settings: card.settings.infos(),
            default_settings: card.settings.defaults(),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let page = [
        (arguments.markdown, pages::catalogue as fn() -> String),
        (arguments.sources, pages::sources),
    ];
    if let Some((_, page)) = page.into_iter().find(|(wanted, _)| *wanted) {
        output::print(&page())?;
        return Ok(ExitCode::SUCCESS);
    }
    let words: Vec<String> = arguments
        .words
        .iter()
        .flat_map(|text| text.split_whitespace())
        .map(str::to_owned)
        .collect();
    let found = found(&words)?;
    if arguments.json {
        let rows = || found.iter().map(|(_, row)| *row);
        let is_found = |card: &&Card| rows().any(|row| card_of(row).is_some_and(|found| found.id == card.id));
        let techniques: Vec<Technique> = techniques::all().iter().filter(is_found).map(Technique::from).collect();
        let systems: Vec<System> = rows().map(System::from).collect();
        output::print_json(&serde_json::json!({ "techniques": techniques, "catalogue": systems }))?;
    } else if words.is_empty() {
        output::print(&everything())?;
    } else {
        output::print(&answer(&found))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The rows that are asked for, each with the place where the words stand: the one with this id, or those with all words, the most telling first.
fn found(words: &[String]) -> Outcome<Vec<(usize, &'static Row)>> {
    let all = || catalogue::all().iter();
    let is_called = |row: &&Row, id: &str| {
        row.id.eq_ignore_ascii_case(id) || card_of(row).is_some_and(|card| card.id.eq_ignore_ascii_case(id))
    };
    let found = match words {
        [] => return Ok(all().map(|row| (0, row)).collect()),
        [id] => all().find(|row| is_called(row, id)),
        _ => None,
    };
    if let Some(row) = found {
        return Ok(vec![(0, row)]);
    }
    let found = search::rows(words, card_of);
    if !found.is_empty() {
        return Ok(found);
    }
    let nearest = match search::nearest(words)[..] {
        [] => String::new(),
        ref ids => format!("nearest: {}; ", ids.join(", ")),
    };
    Err(
        Failure::usage(format!("no technique or system has {:?}", words.join(" "))).hint(format!(
            "{nearest}`clerestory list` shows all of them; hard cases are `clerestory stability --list`, experiments `clerestory report --list`"
        )),
    )
}

/// All techniques in short, and a line for each system.
fn everything() -> String {
    let rows = techniques::all().iter().filter_map(catalogue::row_of);
    let mut texts: Vec<String> = rows
        .filter_map(|row| catalogue::find(row.id))
        .map(|row| text(&row.into(), false))
        .collect();
    // What is longest comes last: lines that a narrow terminal breaks stay readable.
    let mut table = Table::new(
        &["id", "role", "module", "bias", "tests", "system: limits"],
        &[1, 2, 3, 5],
    );
    for row in catalogue::all() {
        let bias = row.bias.map_or("-", |bias| bias_text(bias).0);
        table.row([
            row.id.to_owned(),
            row.role.to_string(),
            row.module.to_owned(),
            bias.to_owned(),
            row.tests.len().to_string(),
            format!("{}: {}", row.name, row.limits),
        ]);
    }
    texts.push(table.text());
    let hint = "`clerestory list ID` shows one of them whole, `clerestory list WORD…` finds them by words: lbvh, octahedron, photon mapping. Hard cases: \
                `clerestory stability --list`. Experiments: `clerestory report --list`\n";
    texts.insert(0, hint.into());
    texts.push(hint.into());
    texts.join("\n")
}

/// The one that is meant whole, where it is plain which; the others in a table.
fn answer(found: &[(usize, &'static Row)]) -> String {
    let plain = match found {
        [_] => true,
        [(0, _), (place, _), ..] => *place > 0,
        _ => false,
    };
    let (whole, others) = found.split_at(usize::from(plain));
    let mut texts = Vec::new();
    for (_, row) in whole {
        texts.push(text(&(*row).into(), true));
        texts.extend(card_of(row).and_then(settings_table));
    }
    if !others.is_empty() {
        let mut table = Table::new(&["id", "role", "code", "system"], &[1, 2, 3]);
        for (_, row) in others {
            table.row([
                row.id.to_owned(),
                row.role.to_string(),
                row.module.to_owned(),
                row.name.to_owned(),
            ]);
        }
        let more = if plain { " more" } else { "" };
        texts.push(table.text());
        texts.push(format!(
            "{}{more} with these words; `clerestory list ID` shows one of them whole\n",
            others.len()
        ));
    }
    texts.join("\n")
}

/// A word for the bias, and its cause.
fn bias_text(bias: Bias) -> (&'static str, &'static str) {
    match bias {
        Bias::Unbiased => ("unbiased", ""),
        Bias::Consistent(cause) => ("consistent", cause),
        Bias::Biased(cause) => ("biased", cause),
    }
}

fn needs_text(needs: &[&str]) -> String {
    if needs.is_empty() {
        "the engine's baseline".into()
    } else {
        needs.join(", ")
    }
}

/// Lines `  name  value` below a head.
fn block(id: &str, facts: &[(&str, String)]) -> String {
    let mut text = output::bold(id) + "\n";
    for (name, value) in facts.iter().filter(|(_, value)| !value.is_empty()) {
        text += &format!("  {name:<11}  {value}\n");
    }
    text
}

/// Lines below each other in a [`block`].
fn lines(values: impl IntoIterator<Item = String>) -> String {
    values.into_iter().collect::<Vec<_>>().join("\n               ")
}

/// A row's folder, with its slash.
fn folder(row: &'static Row) -> &'static str {
    row.module.rfind('/').map_or("", |end| &row.module[..=end])
}

fn cite_text(cite: &Cite) -> String {
    match cite.place {
        "" => cite.source.to_string(),
        place => format!("{}: {place}", cite.source),
    }
}

/// Where the figures are.
fn results_text(pages: &[Page]) -> String {
    if pages.is_empty() {
        "none kept: the experiment prints them".into()
    } else {
        lines(pages.iter().map(|page| page.path.clone()))
    }
}

fn parts_text(id: &str) -> String {
    let parts: Vec<&str> = catalogue::parts_of(id).map(|row| row.id).collect();
    if parts.is_empty() {
        "none".into()
    } else {
        parts.join(", ")
    }
}

/// Where what can be chosen of a system is: its own settings, or those of what it is a part of.
fn settings_of(row: &Row) -> String {
    let names: Vec<&str> = card_of(row).map_or_else(Vec::new, |card| {
        card.settings.infos().iter().map(|setting| setting.name).collect()
    });
    let (paths, own): (Vec<&str>, Vec<&str>) = row.settings.iter().partition(|text| text.starts_with("clerestory"));
    let paths = paths
        .iter()
        .map(|text| format!("`{}`", text.trim_start_matches("clerestory::")));
    let mut texts: Vec<String> = names.iter().chain(&own).map(|name| format!("`{name}`")).collect();
    let whole = whole_of(row);
    if let Some(card) = whole.and_then(card_of).filter(|_| !own.is_empty()) {
        texts.push(format!("of technique `{}`", card.id));
    }
    texts.extend(paths);
    match whole {
        _ if !texts.is_empty() => texts.join(", ").replace(", of technique", " of technique"),
        Some(whole) => card_of(whole).map_or_else(
            || format!("those of {}", whole.id),
            |card| format!("those of technique `{}`", card.id),
        ),
        None => "none".into(),
    }
}

/// The nearest system with settings that a row is a part of.
fn whole_of(row: &Row) -> Option<&'static Row> {
    let Role::PartOf(of) = row.role else { return None };
    let whole = catalogue::find(of)?;
    let has_some = !whole.settings.is_empty() || card_of(whole).is_some_and(|card| !card.settings.infos().is_empty());
    if has_some { Some(whole) } else { whole_of(whole) }
}

/// What a system is and where all of it is; not whole, a technique in short.
fn text(system: &System, whole: bool) -> String {
    let (row, card) = (system.row, system.card);
    let owned = |texts: &[&str]| lines(texts.iter().map(|text| (*text).to_owned()));
    let only = |wanted: bool, text: String| if wanted { text } else { String::new() };
    let sources = if row.sources.is_empty() {
        "the engine's own".into()
    } else {
        lines(row.sources.iter().map(cite_text))
    };
    let mut settings = settings_of(row);
    let explained = card.map(|card| (card, !card.settings.infos().is_empty()));
    if let Some((card, true)) = explained {
        settings += &only(!whole, format!("; `clerestory list {}` explains them", card.id));
    } else if let Some(card) = whole_of(row).and_then(card_of).filter(|card| {
        let mut own = row.settings.iter();
        row.settings.is_empty() || own.any(|name| card.settings.has(name))
    }) {
        settings += &format!("; `clerestory list {}` explains them", card.id);
    }
    let code = if row.module.ends_with("/mod.rs") || card.is_some() {
        let file = only(whole, row.module.to_owned());
        lines(
            [folder(row).to_owned(), file]
                .into_iter()
                .filter(|text| !text.is_empty()),
        )
    } else {
        row.module.to_owned()
    };
    let tests = if whole {
        owned(row.tests)
    } else {
        lines(pages::test_files(row.tests).map(str::to_owned))
    };
    let head = card.map_or(row.id.to_owned(), |card| format!("{} ({})", card.id, row.id));
    block(
        &head,
        &[
            ("system", only(whole, row.name.into())),
            ("technique", card.map(|card| card.summary.into()).unwrap_or_default()),
            ("role", only(whole, row.role.to_string())),
            ("limits", row.limits.into()),
            ("bias", row.bias.map(|bias| bias.to_string()).unwrap_or_default()),
            ("path set", row.path_set.unwrap_or_default().into()),
            ("needs", needs_text(row.needs)),
            ("call", owned(row.api)),
            ("settings", settings),
            ("code", code),
            (
                "kernels",
                if row.shaders.is_empty() {
                    "none: runs on the host".into()
                } else {
                    owned(row.shaders)
                },
            ),
            ("tests", tests),
            (
                "hard cases",
                card.map(|card| format!("docs/stability.md, `clerestory stability --technique {}`", card.id))
                    .unwrap_or_default(),
            ),
            ("measured by", lines(system.measured_by.iter().cloned())),
            ("results", results_text(&system.results)),
            ("sources", only(whole, sources)),
            ("parts", parts_text(row.id)),
        ],
    )
}

/// What each setting means; `None` for a technique without any.
fn settings_table(card: &Card) -> Option<String> {
    let settings = card.settings.infos();
    let mut table = Table::new(&["setting", "default", "unit", "range", "meaning"], &[1, 2, 3, 4]);
    for setting in &settings {
        table.row([
            setting.name.to_owned(),
            setting.default.to_string(),
            if setting.unit.is_empty() { "-" } else { setting.unit }.to_owned(),
            setting.range.clone(),
            setting.meaning.clone(),
        ]);
    }
    (!settings.is_empty()).then(|| table.text())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(words: &str) -> String {
        let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
        answer(&found(&words).unwrap_or_else(|failure| panic!("{words:?}: {}", failure.message)))
    }

    #[test]
    fn words_show_the_one_that_is_meant_and_name_the_others() {
        let lbvh = of("lbvh");
        for said in [
            "CL-LBVH\n",
            "  call         clerestory::accel::lbvh::build\n",
            "`accel::lbvh::LbvhSettings`",
            "`clerestory render --index lbvh`",
            "shaders/accel/lbvh_retry.comp",
            "results/build-stages/README.md",
            "\nCL-TREELETS",
            "`clerestory list ID`",
        ] {
            assert!(lbvh.contains(said), "{said}: {lbvh}");
        }
        let photon = of("photon mapping");
        assert!(
            photon.starts_with("photon (PM-SYS-1)\n") && photon.contains("samples_per_pass"),
            "{photon}"
        );
        let octahedra = of("octahedron");
        assert!(
            octahedra.starts_with("id ") && octahedra.contains("\nOEM-1 "),
            "{octahedra}"
        );
        // An id is that of one alone, though many have the word.
        assert!(of("path").starts_with("path (BG-3)\n") && !of("path").contains("`clerestory list ID`"));
    }

    #[test]
    fn nothing_is_said_of_what_is_not_there() {
        // Of a technique without settings and parts.
        let bare = of("CL-AMBIENT");
        for said in ["  settings     none\n", "  parts        none\n"] {
            assert!(bare.contains(said), "{said}: {bare}");
        }
        assert!(!bare.contains("explains"), "{bare}");
        let failure = found(&["lbhv".to_owned()]).expect_err("no such word");
        assert!(failure.hint.is_some_and(|hint| hint.contains("CL-LBVH")));
    }

    #[test]
    fn settings_of_parts_are_where_their_whole_has_them() {
        let settings = |id: &str| settings_of(catalogue::find(id).expect("row"));
        assert_eq!(settings("PM-DE-2"), "`profile` of technique `photon`");
        assert_eq!(settings("PM-PD-2"), "those of technique `photon`");
        assert_eq!(settings("CL-BOX-LOBE"), "those of OEM-6");
        assert_eq!(settings("PM-X-0"), "none");
        assert_eq!(settings("PM-B-4"), "`kernels::RadixSortOptions`");
        for row in catalogue::all().iter().filter(|row| row.role == Role::Kernel) {
            assert!(!row.api.is_empty(), "{}", row.id);
        }
    }
}
