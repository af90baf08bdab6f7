use clerestory::gpu::*; use clerestory::transport::*; use clerestory::film::*; use std::sync::Arc;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let scene = clerestory::scene::load(&a[1]).unwrap();
    for n in &scene.notes { println!("note {n:?}"); }
    let gpu = Gpu::headless(&GpuOptions::default()).unwrap();
    let t0 = std::time::Instant::now();
    let gs = Arc::new(GpuScene::new(&gpu, &scene).unwrap());
    println!("{}\nupload {:?}", gs.profile(), t0.elapsed());
    let size: u32 = a[3].parse().unwrap(); let spp: u32 = a[4].parse().unwrap();
    let slots: u32 = a.get(5).map_or(0, |s| s.parse().unwrap());
    let mut pt = PathTracer::new(&gpu, gs, &scene.cameras[0], [size, size], PathTracerSettings { aovs: false, paths_in_flight: slots, ..Default::default() }).unwrap();
    pt.step(1).unwrap();
    let c0 = pt.counters();
    println!("first wave {:?}", t0.elapsed());
    let t = std::time::Instant::now();
    let mut by = std::collections::BTreeMap::new();
    while let Some(s) = pt.step(spp).unwrap() { for x in s.timings { for p in x.passes { let e = by.entry(p.name).or_insert((0u64,0u64)); e.0 += 1; e.1 += p.nanoseconds.unwrap(); } } }
    let s = t.elapsed().as_secs_f64();
    let c = pt.counters();
    println!("{c:?} {s} s: {:.3} Mpaths/s {:.3} Mrays/s", (c.paths-c0.paths) as f64 / s * 1e-6, (c.extend_rays + c.shadow_rays - c0.extend_rays - c0.shadow_rays) as f64 / s * 1e-6);
    for (n, (k, ns)) in by { println!("{n:20} {k:6} {:8.2} ms", ns as f64 * 1e-6); }
    let (p, bad) = pt.picture().unwrap();
    println!("non finite {bad}");
    exr::write(std::path::Path::new(&a[2]), &p).unwrap();
    png::write(&std::path::Path::new(&a[2]).with_extension("png"), &png::tone_mapped(p.layer("radiance").unwrap(), size, &tone::ToneMap { exposure: 0.0, curve: tone::ToneCurve::PbrNeutral })).unwrap();
    for m in gpu.take_validation_messages() { println!("{m:?}"); }
}
