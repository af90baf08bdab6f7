use super::*;
use clerestory_hard_cases::{all, judge, subjects};
#[test]
fn zz_long() {
    let Ok(which) = std::env::var("BDPT_LONG") else { return };
    with_gpu(|gpu| {
        for subject in subjects().iter().filter(|subject| subject.name() == which) {
            for case in all() {
                let clock = std::time::Instant::now();
                let outcome = judge(gpu, case, subject);
                println!("CASE {:.1} s {outcome:?}", clock.elapsed().as_secs_f64());
            }
        }
    });
}
