//! kd-trees: probabilities of their nodes, what the heuristics and the traversals cost rays, whether all find the same hits, and where they
//! beat bounding volumes.

mod cache_costs;
mod cache_ranking;
pub mod flights;
mod heuristic_trees;
pub mod hit_errors;
pub mod kd_caches;
pub mod kd_heuristics;
pub mod kd_hosts;
pub mod kd_or_bvh;
pub mod kd_probability;
pub mod kd_rays;
pub mod kd_threads;
pub mod kd_traversal;
mod kd_variants;
mod named_nodes;
mod published;
mod ray_checks;
mod ray_kinds;
mod real_models;
mod restarts;
mod tree_kinds;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::findings::{Findings, Study};
    use crate::experiments::measures::Context;
    use crate::experiments::table::Cell;
    use crate::experiments::watch::Unwatched;
    use clerestory::gpu::{DeviceKind, Gpu, GpuOptions};

    fn findings<S: Study>(context: &Context<'_>) -> Findings {
        S::measure(context).unwrap().findings()
    }

    #[test]
    fn no_table_has_hits_that_differ() {
        let scenes = ["builtin:cornell-box".to_owned()];
        let mut context = Context {
            smoke: true,
            scenes: &[],
            gpu: &|| Gpu::headless(&GpuOptions::default()),
            folder: std::path::Path::new(""),
            watch: &Unwatched,
        };
        if (context.gpu)().unwrap().caps().kind != DeviceKind::Cpu {
            // Only software devices must have the host's bits.
            return;
        }
        for (findings, columns) in [
            (findings::<kd_traversal::Found> as fn(&Context<'_>) -> _, 2),
            (findings::<kd_caches::Found>, 2),
            (findings::<kd_threads::Found>, 1),
            (findings::<kd_or_bvh::Found>, 1),
            (findings::<kd_hosts::Found>, 1),
        ] {
            for scenes in [&[][..], &scenes] {
                context.scenes = scenes;
                let table = &findings(&context).tables[0];
                let differ = (0..table.heads.len()).filter(|column| table.heads[*column].contains("differ"));
                let differ: Vec<usize> = differ.collect();
                assert_eq!(differ.len(), columns, "{}", table.title);
                for row in &table.rows {
                    assert!(differ.iter().all(|column| row[*column] == Cell::Count(0)), "{row:?}");
                    assert!(scenes.is_empty() || row[0] == Cell::from("cornell-box"), "{row:?}");
                }
            }
        }
    }
}
