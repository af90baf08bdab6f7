//! What `clerestory index --peers` writes: tables as Markdown, JSON and CSV, charts of rates and of where the time goes, and its part of the page of results.

use clerestory_tools::experiments::bars::{self, Bar, Group, Row};
use clerestory_tools::experiments::table::Table;
use clerestory_tools::page::Block;

use super::verdicts::verdicts;
use super::work::Work;
use super::{BASE, Found, KINDS, Measured};
use crate::failure::Outcome;
use crate::output;
use crate::outputs::NamedFile;

/// The part of a page.
pub(super) const BLOCK: Block<'static> = Block {
    name: "indexes and rays beside other libraries",
    command: "clerestory index --peers",
};

/// The files in a folder; a chart may be left out.
pub const FILES: [&str; 6] = [
    "index.json",
    "index.md",
    "index.csv",
    "index-work.csv",
    "index-rates.svg",
    "index-work.svg",
];

/// Words of the parts of time, in the order of [`Work::shares`].
const PARTS: [&str; 4] = ["inner nodes", "triangles", "lanes that wait", "begin and end of rays"];

/// The files of what was found.
pub fn files(found: &Found) -> Outcome<Vec<NamedFile>> {
    let [json, page, csv, work_csv, rates_svg, work_svg] = FILES;
    let mut files = vec![
        NamedFile::new(json, output::json_text(json, found)?),
        NamedFile::new(page, markdown(found)),
        NamedFile::new(csv, rates(found).csv()),
        NamedFile::new(work_csv, work(found).csv()),
    ];
    for (name, svg) in [(rates_svg, chart_of_rates(found)?), (work_svg, chart_of_work(found)?)] {
        files.extend(svg.map(|svg| NamedFile::new(name, svg)));
    }
    Ok(files)
}

/// Facts, verdicts and tables.
pub fn markdown(found: &Found) -> String {
    let mut text = output::one_line(&format!(
        "- Device of our kernels: {}; driver: {}.",
        found.device, found.driver
    ));
    text += &format!(
        "\n- Machine: {}, {} threads; load average {} when it began. Clerestory {}. Medians of {} runs in turns.\n",
        found.processor,
        found.threads,
        found.load.as_deref().unwrap_or("unknown"),
        found.engine_version,
        found.repeat
    );
    for absent in &found.absent {
        text += &format!("- Absent: {absent}.\n");
    }
    text += "\nVerdicts, over the scenes; an index of ours counts once, whichever is best:\n\n";
    for judged in verdicts(found) {
        text += &format!("- {judged}\n");
    }
    format!("{text}\n{}\n{}", rates(found).markdown(), work(found).markdown())
}

/// Median with half the range in per cent.
fn spread(spread: super::Spread, scale: f64, digits: usize) -> String {
    format!(
        "{:.digits$} ± {:.0} %",
        scale * spread.median,
        100.0 * spread.relative()
    )
}

fn rates(found: &Found) -> Table {
    let mut table = Table::new(
        "Builds and rays per second",
        &[
            "scene",
            "triangles",
            "index",
            "build (ms)",
            "SAH cost",
            "primary (M rays/s)",
            "primary ratio",
            "diffuse (M rays/s)",
            "diffuse ratio",
            "primary rays that differ",
            "diffuse rays that differ",
        ],
    );
    for one in &found.indexes {
        table.row([
            one.scene.clone().into(),
            (one.triangles as u64).into(),
            one.index.clone().into(),
            spread(one.build, 1e3, 1).into(),
            one.sah_cost.map_or("–".into(), Into::into),
            spread(one.mrays_per_second[0], 1.0, 2).into(),
            one.ratios[0].into(),
            spread(one.mrays_per_second[1], 1.0, 2).into(),
            one.ratios[1].into(),
            one.disagreement[0].to_string().into(),
            one.disagreement[1].to_string().into(),
        ]);
    }
    let most = |kind: usize| found.indexes.iter().map(|one| one.rays[kind]).max().unwrap_or(0);
    table.note(format!(
        "Ratios are to {BASE}. Up to {} primary and {} diffuse rays, the same for all, in the same order; ± is half the range of the runs. Our \
         indexes are traced by the device's kernel, which on a software device runs on the same threads as the peers; obvhs and bvh with \
         the Möller–Trumbore test of obvhs. Embree is asked ray by ray.",
        most(0),
        most(1)
    ));
    table.note(
        "Rays that differ from our first index, whose hits are those of trying all triangles: \"same place\" is another triangle at the same \
         distance up to rounding, as at an edge that two triangles share, where we take the one of least index and others the one that \
         comes first; \"lost\", \"gained\" and \"elsewhere\" are rays near edges or within rounding of a plane, where tests that round otherwise decide \
         otherwise. Our test closes the seams between triangles.",
    );
    table
}

fn work(found: &Found) -> Table {
    let mut table = Table::new(
        "Where the time of our rays goes",
        &[
            "scene",
            "index",
            "rays",
            "nodes per ray",
            "triangles per ray",
            "fetches per ray",
            "bytes per ray",
            "iterations per subgroup",
            "busy lanes (%)",
            "time at nodes (%)",
            "at triangles (%)",
            "lanes that wait (%)",
            "begin and end (%)",
            "fitted / measured time",
        ],
    );
    let mut costs: Vec<&Work> = Vec::new();
    for one in &found.work {
        if costs
            .last()
            .is_none_or(|last| (&last.scene, last.costs) != (&one.scene, one.costs))
        {
            costs.push(one);
        }
        let [nodes, triangles, waiting, ends] = one.shares.map(|share| 100.0 * share);
        table.row([
            one.scene.clone().into(),
            one.index.into(),
            one.kind.into(),
            one.nodes.into(),
            one.triangles.into(),
            one.fetches.into(),
            one.bytes.into(),
            one.iterations.into(),
            (100.0 * one.busy_lanes).into(),
            nodes.into(),
            triangles.into(),
            waiting.into(),
            ends.into(),
            one.fitted.into(),
        ]);
    }
    table.note(
        "Counts are exact: the twin of the kernel gives each ray's steps, and those of a subgroup's rays run side by side. Parts of the rays \
         are traced by themselves, and their times are fitted as a sum over counts, without negative costs: of subgroups, of \
         iterations, and of what nodes and triangles add to these. An iteration's time belongs in equal shares to its lanes. A fetch \
         is 16 bytes: four per binary node, five per wide one, three per triangle, every access served by itself, without the stack.",
    );
    for one in costs {
        let [ends, nodes, triangles, both] = one.costs;
        table.note(format!(
            "{}, {}: {ends:.0} ns a subgroup, {nodes:.1} ns an iteration with nodes only, {triangles:.1} ns with triangles only, {both:.1} ns with \
             both, all threads together; the parts' times are met within {:.1} % (root of the mean square).",
            one.scene,
            if one.is_wide { "wide" } else { "binary" },
            100.0 * one.relative_error
        ));
    }
    table
}

/// Names of the scenes, in their order.
fn scenes<'a, T>(rows: &'a [T], scene: impl Fn(&'a T) -> &'a str) -> Vec<&'a str> {
    let mut names: Vec<&str> = rows.iter().map(scene).collect();
    names.dedup();
    names
}

fn chart_of_rates(found: &Found) -> clerestory::Result<Option<String>> {
    let row = |one: &Measured| Row {
        name: one.index.clone(),
        bars: (0..KINDS.len())
            .map(|kind| {
                let rate = one.mrays_per_second[kind];
                Bar {
                    parts: vec![(kind, rate.median)],
                    range: Some([rate.least, rate.greatest]),
                    figure: format!("{:.2}", rate.median),
                }
            })
            .collect(),
    };
    let group = |scene: &str| {
        let of_scene: Vec<&Measured> = found.indexes.iter().filter(|one| one.scene == scene).collect();
        let triangles = of_scene.first().map_or(0, |one| one.triangles);
        Group {
            head: format!("{}, {triangles} triangles", scene.trim_start_matches("builtin:")),
            rows: of_scene.into_iter().map(row).collect(),
        }
    };
    let groups: Vec<Group> = scenes(&found.indexes, |one| &one.scene)
        .into_iter()
        .map(group)
        .collect();
    bars::draw("Million rays per second", &KINDS, &groups)
}

fn chart_of_work(found: &Found) -> clerestory::Result<Option<String>> {
    let row = |one: &Work| {
        let each = 1e-3 * one.nanoseconds;
        Row {
            name: format!("{}, {}", one.index, one.kind),
            bars: vec![Bar {
                parts: one.shares.iter().map(|share| share * each).enumerate().collect(),
                range: None,
                figure: format!("{each:.2} µs"),
            }],
        }
    };
    let group = |scene: &str| Group {
        head: scene.trim_start_matches("builtin:").to_owned(),
        rows: found.work.iter().filter(|one| one.scene == scene).map(row).collect(),
    };
    let groups: Vec<Group> = scenes(&found.work, |one| &one.scene).into_iter().map(group).collect();
    bars::draw(
        "Where the time of our rays goes: µs a ray, all threads together",
        &PARTS,
        &groups,
    )
}
