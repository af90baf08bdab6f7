//! The catalogue and its sources as pages of Markdown.

use super::{Cite, Row, all, citations};

/// The catalogue as a page of Markdown.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Catalogue\n\nWhere each publication lives in the code. Written by `clerestory list --markdown`; `clerestory list ID` also names \
         the tests and shaders of a system. Roles: a *technique* makes pictures (`clerestory render --technique`), a *kernel* is a building \
         block for hosts, a *service* is what the engine does around both, a *yardstick* is only measured. Keys of sources are those of \
         [`third_party_notes/sources.md`](../third_party_notes/sources.md).\n\n\
         | id | system | role | limits | sources | module | bias | path set | needs | tests | measured by |\n\
         |---|---|---|---|---|---|---|---|---|---:|---|\n",
    );
    for row in all() {
        let bias = row.bias.map_or("–".to_owned(), |bias| bias.to_string());
        let needs = if row.needs.is_empty() {
            "baseline".to_owned()
        } else {
            row.needs.join(", ")
        };
        page += &format!(
            "| {} | {} | {} | {} | {} | [{}](../{}) | {bias} | {} | {needs} | {} | `{}` |\n",
            row.id,
            row.name,
            row.role,
            row.limits,
            keys(row),
            row.module.trim_start_matches("engine/src/"),
            row.module,
            row.path_set.unwrap_or("–"),
            row.tests.len(),
            row.experiment,
        );
    }
    page
}

/// The keys of a row's sources with their places.
fn keys(row: &Row) -> String {
    let cite = |cite: &Cite| match cite.place {
        "" => cite.source.key.to_owned(),
        place => format!("{} ({place})", cite.source.key),
    };
    if row.sources.is_empty() {
        "the engine's own".into()
    } else {
        row.sources.iter().map(cite).collect::<Vec<_>>().join("; ")
    }
}

/// The sources that rows cite, each with those rows, as a page of Markdown.
pub fn sources_markdown() -> String {
    let mut page = String::from(
        "# Sources of the catalogue\n\nPublications that rows of the [catalogue](../docs/catalogue.md) cite, with the rows that do. Written by \
         `clerestory list --sources`. What was taken from each, in which file, stands in the page of its floor; publications carry no licence \
         that code written from them would have to repeat.\n\n\
         | key | source | rows |\n|---|---|---|\n",
    );
    for (source, rows) in citations() {
        let rows = rows.iter().map(|(id, place)| match *place {
            "" => (*id).to_owned(),
            place => format!("{id} ({place})"),
        });
        let rows: Vec<String> = rows.collect();
        page += &format!("| {} | {source} | {} |\n", source.key, rows.join("; "));
    }
    page
}
