//! `clerestory bench --sort`: keys per second of the radix sort beside sorts on the processor, in the same run. Where one workgroup sorts in one dispatch, the form for
//! more keys is timed beside it.
//!
//! Peers: the standard library's sorts, and with `--peers` those of the crates rdst (all threads, or one) and radsort. Every sorter sorts
//! the same random keys; sorters take turns, and medians count.

use clerestory::gpu::{BufferDesc, Category, Gpu};
use clerestory::kernels::{Count, Form, KeyWidth, RadixSort, RadixSortOptions, SortBuffers};
use clerestory::{Error, Result};
use clerestory_tools::experiments::plot::{self, Curve, PlotPoint, Words};
use clerestory_tools::experiments::table::Table as Sheet;
use clerestory_tools::random::Random;
use clerestory_tools::timing::{median, timed};
use rdst::{RadixKey, RadixSort as _};

use crate::failure::Outcome;
use crate::output::{self, Table};
use crate::outputs::NamedFile;

/// Sizes as powers of two: all at which one workgroup may sort, and every other one.
const SIZES: [u32; 12] = [8, 9, 10, 11, 12, 13, 14, 16, 18, 20, 22, 24];
/// Names of the kernels: by the form that the engine chooses, and by that for more keys than one workgroup sorts.
const KERNEL: &str = "kernel";
const MANY_GROUPS: &str = "kernel, many workgroups";

/// What is sorted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Load {
    /// 32-bit keys.
    Keys,
    /// 32-bit keys, each with a 32-bit value.
    Pairs,
}

impl Load {
    const ALL: [Self; 2] = [Self::Keys, Self::Pairs];

    fn word(self) -> &'static str {
        match self {
            Self::Keys => "keys",
            Self::Pairs => "pairs",
        }
    }
}

/// The rate of one sorter at one size.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Rate {
    load: Load,
    sorter: &'static str,
    /// Number of keys.
    keys: u32,
    /// Median, by wall clock; on the device from submission to the end of waiting.
    keys_per_second: f64,
    /// Least and greatest.
    range: [f64; 2],
}

/// A key with its value, for sorters of structs.
#[derive(Debug, Clone, Copy)]
struct Pair {
    key: u32,
    value: u32,
}

impl RadixKey for Pair {
    const LEVELS: usize = size_of::<u32>();

    fn get_level(&self, level: usize) -> u8 {
        self.key.to_le_bytes()[level]
    }
}

/// What is sorted by its key.
trait Element: Copy {
    fn pair(self) -> Pair;
}

impl Element for u32 {
    /// Bare keys stand for themselves.
    fn pair(self) -> Pair {
        Pair { key: self, value: self }
    }
}

impl Element for Pair {
    fn pair(self) -> Pair {
        self
    }
}

/// Gives the seconds it took; what has been sorted goes into a vector, if one is given.
type Run<'a> = Box<dyn FnMut(Option<&mut Vec<Pair>>) -> Result<f64> + 'a>;

/// A sort to be measured.
struct Sorter<'a> {
    name: &'static str,
    run: Run<'a>,
}

impl<'a> Sorter<'a> {
    fn of<T: Element>(name: &'static str, data: &'a [T], sort: impl Fn(&mut [T]) + 'a) -> Self {
        let run = move |sorted: Option<&mut Vec<Pair>>| {
            let mut data = data.to_vec();
            let ((), seconds) = timed(|| sort(&mut data));
            let data = std::hint::black_box(data);
            if let Some(sorted) = sorted {
                sorted.extend(data.into_iter().map(Element::pair));
            }
            Ok(seconds)
        };
        Self {
            name,
            run: Box::new(run),
        }
    }
}

/// Measures all sizes; one run before the measured ones compiles the kernels and warms caches.
pub fn measure(gpu: &Gpu, repeat: u32, with_peers: bool) -> Result<Vec<Rate>> {
    let mut rates = Vec::new();
    for size in SIZES {
        let keys = random_keys(1 << size);
        let pairs: Vec<Pair> = keys
            .iter()
            .zip(0..)
            .map(|(key, value)| Pair { key: *key, value })
            .collect();
        for load in Load::ALL {
            let mut sorters = match load {
                Load::Keys => of_keys(&keys, with_peers),
                Load::Pairs => of_pairs(&pairs, with_peers),
            };
            let sort = |form| {
                let options = RadixSortOptions {
                    form,
                    ..RadixSortOptions::new(KeyWidth::Bits32, load == Load::Pairs)
                };
                RadixSort::new(gpu, options)
            };
            let auto = sort(Form::Auto)?;
            if keys.len() as u32 <= auto.one_dispatch_up_to() {
                let form = match Form::Auto.on(gpu.caps(), KERNEL)? {
                    Form::Subgroup => Form::Subgroup,
                    _ => Form::Serial,
                };
                sorters.insert(0, by_kernel(gpu, MANY_GROUPS, sort(form)?, &keys, load)?);
            }
            sorters.insert(0, by_kernel(gpu, KERNEL, auto, &keys, load)?);
            rates.extend(rates_of(sorters, load, &keys, repeat)?);
        }
    }
    Ok(rates)
}

/// Rates of sorters in turns. Of the run before the measured ones the result is checked.
fn rates_of(mut sorters: Vec<Sorter<'_>>, load: Load, input: &[u32], repeat: u32) -> Result<Vec<Rate>> {
    let keys = input.len() as u32;
    let mut expected = input.to_vec();
    expected.sort_unstable();
    let mut rates = vec![Vec::new(); sorters.len()];
    for (sorter, rates) in sorters.iter_mut().zip(&mut rates) {
        let mut sorted = Vec::with_capacity(input.len());
        (sorter.run)(Some(&mut sorted))?;
        let in_order = sorted.iter().map(|pair| pair.key).eq(expected.iter().copied());
        let is_moved = |pair: &Pair| load == Load::Keys || input.get(pair.value as usize) == Some(&pair.key);
        if !in_order || !sorted.iter().all(is_moved) {
            return Err(Error::setting(
                "sorter",
                sorter.name,
                format!("has not sorted {keys} {}", load.word()),
            ));
        }
        rates.reserve(repeat as usize);
    }
    for _ in 0..repeat {
        for (sorter, rates) in sorters.iter_mut().zip(&mut rates) {
            rates.push(f64::from(keys) / (sorter.run)(None)?);
        }
    }
    let rate = |(sorter, rates): (&Sorter<'_>, Vec<f64>)| Rate {
        load,
        sorter: sorter.name,
        keys,
        range: [
            rates.iter().copied().fold(f64::INFINITY, f64::min),
            rates.iter().copied().fold(0.0, f64::max),
        ],
        keys_per_second: median(rates),
    };
    Ok(sorters.iter().zip(rates).map(rate).collect())
}

fn of_keys(keys: &[u32], with_peers: bool) -> Vec<Sorter<'_>> {
    let mut sorters = vec![
        Sorter::of("std unstable", keys, <[u32]>::sort_unstable),
        Sorter::of("std stable", keys, <[u32]>::sort),
    ];
    if with_peers {
        sorters.extend([
            Sorter::of("rdst", keys, |keys| keys.radix_sort_unstable()),
            Sorter::of("rdst, one thread", keys, |keys| {
                keys.radix_sort_builder().with_single_threaded_tuner().sort();
            }),
            Sorter::of("radsort", keys, radsort::sort),
        ]);
    }
    sorters
}

fn of_pairs(pairs: &[Pair], with_peers: bool) -> Vec<Sorter<'_>> {
    let mut sorters = vec![Sorter::of("std stable", pairs, |pairs| {
        pairs.sort_by_key(|pair| pair.key);
    })];
    if with_peers {
        sorters.extend([
            Sorter::of("std unstable", pairs, |pairs| {
                pairs.sort_unstable_by_key(|pair| (pair.key, pair.value));
            }),
            Sorter::of("rdst", pairs, |pairs| pairs.radix_sort_unstable()),
            Sorter::of("rdst, one thread", pairs, |pairs| {
                pairs.radix_sort_builder().with_single_threaded_tuner().sort();
            }),
            Sorter::of("radsort", pairs, |pairs| {
                radsort::sort_by_key(pairs, |pair| pair.key);
            }),
        ]);
    }
    sorters
}

/// Hashes of their places.
fn random_keys(count: u32) -> Vec<u32> {
    let mut random = Random::new(0);
    (0..count).map(|_| random.word()).collect()
}

fn by_kernel<'a>(gpu: &'a Gpu, name: &'static str, sort: RadixSort, keys: &'a [u32], load: Load) -> Result<Sorter<'a>> {
    let count = keys.len() as u32;
    let values = load == Load::Pairs;
    let sides = [sort.keys("keys", count)?, sort.keys("other keys", count)?];
    let values_of = [sort.values("values", count)?, sort.values("other values", count)?];
    let scratch = gpu.buffer(&BufferDesc::storage(
        "scratch",
        sort.scratch_bytes(count),
        Category::Work,
    ))?;
    let run = move |sorted: Option<&mut Vec<Pair>>| {
        let buffers = SortBuffers {
            keys: [&sides[0], &sides[1]],
            values: values.then_some([&values_of[0], &values_of[1]]),
        };
        gpu.upload(sides[0].buffer(), 0, keys)?;
        if values {
            gpu.upload(values_of[0].buffer(), 0, &(0..count).collect::<Vec<_>>())?;
        }
        let mut recorder = gpu.recorder("sort")?;
        let mut side = 0;
        recorder.pass("sort", |pass| {
            side = sort.record(pass, &buffers, Count::Host(count), &scratch)?;
            Ok(())
        })?;
        let (waited, seconds) = timed(|| recorder.submit()?.wait());
        waited?;
        if let Some(sorted) = sorted {
            let keys: Vec<u32> = gpu.read(sides[side].buffer().view(), keys.len())?;
            let values = if values {
                gpu.read(values_of[side].buffer().view(), keys.len())?
            } else {
                keys.clone()
            };
            sorted.extend(keys.iter().zip(&values).map(|(key, value)| Pair {
                key: *key,
                value: *value,
            }));
        }
        Ok(seconds)
    };
    Ok(Sorter {
        name,
        run: Box::new(run),
    })
}

/// Sorters of a load in their order.
fn sorters(rates: &[Rate], load: Load) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = Vec::new();
    for rate in rates.iter().filter(|rate| rate.load == load) {
        if !names.contains(&rate.sorter) {
            names.push(rate.sorter);
        }
    }
    names
}

/// Heads and rows of a load's table, a sorter a column.
fn cells(rates: &[Rate], load: Load, cell: impl Fn(&Rate) -> String) -> Vec<Vec<String>> {
    let names = sorters(rates, load);
    let mut rows = vec![
        [load.word()]
            .iter()
            .chain(&names)
            .map(|name| (*name).to_owned())
            .collect(),
    ];
    for size in SIZES {
        let of_size: Vec<&Rate> = rates
            .iter()
            .filter(|rate| rate.load == load && rate.keys == 1 << size)
            .collect();
        if !of_size.is_empty() {
            // A sorter may have been left out.
            let of_sorter = |name: &&str| of_size.iter().find(|rate| rate.sorter == *name);
            let row = names
                .iter()
                .map(|name| of_sorter(name).map_or_else(String::new, |rate| cell(rate)));
            rows.push([(1u32 << size).to_string()].into_iter().chain(row).collect());
        }
    }
    rows
}

/// The rates as tables, one for keys and one for pairs.
pub fn tables(rates: &[Rate]) -> String {
    let mut text = String::new();
    for load in Load::ALL {
        let rows = cells(rates, load, |rate| output::metric(rate.keys_per_second));
        let heads: Vec<&str> = rows[0].iter().map(String::as_str).collect();
        let mut table = Table::new(&heads, &[]);
        for row in &rows[1..] {
            table.row(row.clone());
        }
        text += &format!("{}\n", table.text());
    }
    text
}

/// The rates with their spread as Markdown tables, in millions per second.
pub fn markdown(rates: &[Rate]) -> String {
    let millions = |rate: f64| {
        let digits = usize::from(rate < 99.95e6);
        format!("{:.digits$}", rate * 1e-6)
    };
    let mut text = String::new();
    for load in Load::ALL {
        let mut rows = cells(rates, load, |rate| {
            let [least, greatest] = rate.range.map(millions);
            format!("{} ({least} … {greatest})", millions(rate.keys_per_second))
        });
        rows.insert(1, vec!["---:".into(); rows[0].len()]);
        text += &format!("Millions of 32-bit {} per second:\n\n", load.word());
        for row in rows {
            text += &format!("| {} |\n", row.join(" | "));
        }
        text += "\n";
    }
    text
}

/// The files in a folder; a plot may be left out.
pub const FILES: [&str; 4] = ["sort.json", "sort.csv", "sort-keys.svg", "sort-pairs.svg"];

/// `sort.json`, `sort.csv` and for each load a plot.
pub fn files(rates: &[Rate], head: &serde_json::Value) -> Outcome<Vec<NamedFile>> {
    let mut files = vec![NamedFile::new("sort.json", output::json_text("sort.json", head)?)];
    let mut sheet = Sheet::new(
        "rates",
        &[
            "load",
            "sorter",
            "keys",
            "keys/s, median",
            "keys/s, least",
            "keys/s, greatest",
        ],
    );
    for rate in rates {
        sheet.row([
            rate.load.word().into(),
            rate.sorter.into(),
            u64::from(rate.keys).into(),
            rate.keys_per_second.into(),
            rate.range[0].into(),
            rate.range[1].into(),
        ]);
    }
    files.push(NamedFile::new("sort.csv", sheet.csv()));
    for load in Load::ALL {
        let curve = |name: &&'static str| Curve {
            name: (*name).into(),
            points: rates
                .iter()
                .filter(|rate| rate.load == load && rate.sorter == *name)
                .map(|rate| PlotPoint {
                    x: rate.keys.into(),
                    y: rate.keys_per_second,
                    y_range: rate.range,
                    ringed: false,
                })
                .collect(),
        };
        let curves: Vec<Curve> = sorters(rates, load).iter().map(curve).collect();
        let words = Words {
            title: &format!("Sorting random 32-bit {}", load.word()),
            x: &format!("number of {}", load.word()),
            y: &format!("{}/s, median, least to greatest", load.word()),
        };
        if let Some(svg) = plot::log_log_of_rates(words, &curves)? {
            files.push(NamedFile::new(format!("sort-{}.svg", load.word()), svg));
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorters_are_checked_measured_and_written() {
        let keys = random_keys(1024);
        let pairs: Vec<Pair> = keys
            .iter()
            .zip(0..)
            .map(|(key, value)| Pair { key: *key, value })
            .collect();
        let wrong = || vec![Sorter::of("idle", &keys, |_| {})];
        assert!(rates_of(wrong(), Load::Keys, &keys, 1).is_err());
        let rates: Vec<Rate> = [
            (of_keys(&keys, true), Load::Keys),
            (of_pairs(&pairs, true), Load::Pairs),
        ]
        .into_iter()
        .flat_map(|(sorters, load)| rates_of(sorters, load, &keys, 1).unwrap())
        .collect();
        assert_eq!(sorters(&rates, Load::Keys).len(), 5);
        assert_eq!(sorters(&rates, Load::Pairs).len(), 5);
        assert!(rates.iter().all(|rate| rate.keys_per_second > 0.0));
        assert!(tables(&rates).contains("radsort"));
        let page = markdown(&rates);
        assert!(
            page.contains("| keys | std unstable |") && page.contains("| 1024 | "),
            "{page}"
        );
        // A sorter that has sorted nothing of a size leaves its place in the row.
        let other = Rate {
            load: Load::Keys,
            sorter: MANY_GROUPS,
            keys: 256,
            keys_per_second: 1e6,
            range: [1e6; 2],
        };
        let rows = cells(&[&rates[..], &[other]].concat(), Load::Keys, |rate| rate.sorter.into());
        assert_eq!(rows[1][1..], ["", "", "", "", "", MANY_GROUPS]);
        assert_eq!(
            rows[2][1..],
            ["std unstable", "std stable", "rdst", "rdst, one thread", "radsort", ""]
        );
        let made = files(&rates, &serde_json::json!({})).unwrap_or_default();
        let names: Vec<&str> = made.iter().map(|file| file.name.as_str()).collect();
        assert_eq!(names, FILES);
    }
}
