//! What the cost model of a device times is what was done.

use clerestory::kernels::device_model::{DeviceModel, MAX_ITERATIONS, STRIDE, cycle};
use clerestory_tests::with_gpu;

#[test]
fn timed_runs_have_walked_copied_and_counted_what_was_asked() {
    with_gpu(|gpu| {
        let model = DeviceModel::new(gpu).unwrap();
        let places = 100;
        let chain = model.chain(u64::from(places * STRIDE)).unwrap();
        let links = cycle(places);
        let mut place = 0;
        for steps in [0, 1, 7, 92, 1000] {
            assert!(chain.walk(steps).unwrap() >= 0.0);
            for _ in 0..steps {
                place = links[place as usize];
            }
            assert_eq!(chain.place().unwrap(), place / (STRIDE / 4), "{steps}");
        }
        let copies = model.copies(1000).unwrap();
        assert_eq!(copies.bytes(), 992);
        assert!(copies.by_kernel().unwrap() >= 0.0 && copies.are_equal().unwrap());
        let copies = model.copies(4096).unwrap();
        assert!(copies.by_command().unwrap() >= 0.0 && copies.are_equal().unwrap());
        for by_subgroup in [false, true] {
            let tickets = model.tickets(3, 5, by_subgroup).unwrap();
            let all = 3 * 64 * 5;
            // Each of the numbers below `all` once.
            assert_eq!((tickets.given, tickets.joined), (all, (0..all).fold(0, |a, b| a ^ b)));
        }
        assert!(model.boundaries(4).unwrap() >= 0.0 && model.submission().unwrap() > 0.0);
        let refused = |error: clerestory::Error| error.to_string();
        assert!(refused(chain.walk(MAX_ITERATIONS + 1).unwrap_err()).contains("32768"));
        assert!(refused(model.chain(64).unwrap_err()).contains("places"));
    });
}
