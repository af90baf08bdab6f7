//! A technique that a host writes: it renders into the engine's film, and is refused where device or scene do not fit.

use std::collections::BTreeMap;

use clerestory::film::{GpuFilm, NonFiniteSamples, Picture, PixelFormat, Step};
use clerestory::gpu::shaders::types::{FilmPixel, TwoFloat};
use clerestory::gpu::{Access, Buffer, BufferDesc, Category, EnabledFeatures, Gpu, PipelineInfo};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::Camera;
use clerestory::settings::{Settings, SettingsDecl};
use clerestory::techniques::{Bias, Card, PathTracerSettings, Skipped, Technique};
use clerestory::transport::PathSet;
use clerestory::{Error, Result};
use clerestory_tests::{assert_no_messages, gpu};

use crate::Host;

clerestory::settings! {
    /// Settings as a host would declare them.
    pub struct EvenSettings {
        /// Radiance of every sample.
        pub radiance: f32 = 1.0, in 0.0.., unit "W·m⁻²·sr⁻¹";
    }
}

/// A technique as a host would write it: every sample of every pixel has the radiance that its settings name.
struct Even {
    gpu: Gpu,
    film: GpuFilm,
    radiance: f32,
    samples: u32,
}

const EVEN: Card = Card {
    id: "even",
    summary: "the same radiance everywhere",
    rows: &[],
    bias: Bias::Biased("looks at nothing"),
    needs: &[],
    kernels: &[],
    path_set: PathSet::ALL,
    refusals: |profile| {
        let lit = !profile.has_environment();
        lit.then(|| "there is no sky".to_owned()).into_iter().collect()
    },
    settings: SettingsDecl::of::<EvenSettings>(),
    variants: &[],
    create: |gpu, _, view, settings| {
        let settings: EvenSettings = settings.read()?;
        Ok(Box::new(Even {
            gpu: gpu.clone(),
            film: GpuFilm::new(gpu, view.size, view.aovs)?,
            radiance: settings.radiance,
            samples: 0,
        }))
    },
};

impl Technique for Even {
    fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        if self.samples >= samples {
            return Ok(None);
        }
        self.samples += 1;
        let times = |x: f32| TwoFloat {
            hi: x * self.samples as f32,
            lo: 0.0,
        };
        let pixel = FilmPixel {
            sum: [times(self.radiance); 3],
            square: [times(self.radiance * self.radiance); 3],
            samples: self.samples,
            nan_samples: 0,
            infinite_samples: 0,
        };
        let mut timings = Vec::new();
        let mut pixels = 0;
        for band in self.film.bands() {
            let sums = vec![pixel; band.pixels() as usize];
            let bytes = size_of_val(sums.as_slice()) as u64;
            let staging = self.gpu.buffer(&BufferDesc::upload("even", bytes))?;
            staging.write(0, &sums)?;
            let mut recorder = self.gpu.recorder("even")?;
            recorder.pass("even: fill", |pass| {
                pass.copy(staging.slice(0, bytes), band.set().film_pixels)?;
                pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
                Ok(())
            })?;
            timings.push(recorder.submit()?.wait()?);
            pixels += u64::from(band.pixels());
        }
        Ok(Some(Step {
            timings,
            done: pixels * u64::from(self.samples),
            wanted: pixels * u64::from(samples),
        }))
    }

    fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.film.picture()
    }

    fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.film.display(target, exposure, format)
    }

    fn set_camera(&mut self, _: &Camera) -> Result<()> {
        self.samples = 0;
        self.film.clear()
    }

    fn path_set(&self) -> PathSet {
        PathSet::ALL
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::json!({"radiance": self.radiance})
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        BTreeMap::new()
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        Vec::new()
    }

    fn skipped(&self) -> Vec<Skipped> {
        Vec::new()
    }
}

#[test]
fn a_technique_of_the_hosts_own_renders_into_the_same_film() {
    let gpu = gpu();
    let scene = clerestory::scene::load("builtin:box-city?n=2").unwrap();
    let renderer = Renderer::new(&gpu, &scene).unwrap();
    let options = RenderOptions {
        size: [5, 3],
        spp: 4,
        settings: EvenSettings { radiance: 0.25 }.into(),
        ..RenderOptions::default()
    };
    let mut rendering = renderer.start_technique(&EVEN, &options).unwrap();
    while rendering.step().unwrap().is_some() {}
    let screen = gpu
        .buffer(&BufferDesc::storage("screen", 4 * 15, Category::Film))
        .unwrap();
    rendering.display(&screen, 2.0, PixelFormat::Rgba8).unwrap();
    assert_eq!(gpu.read::<u32>(screen.view(), 15).unwrap(), [u32::MAX; 15]);
    let small = gpu.buffer(&BufferDesc::storage("small", 56, Category::Film)).unwrap();
    let error = rendering
        .display(&small, 0.0, PixelFormat::Rgba8)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("small") && error.contains("56") && error.contains("60"),
        "{error}"
    );
    let rendered = rendering.finish().unwrap();
    assert_eq!(rendered.picture.layer("radiance").unwrap().values(), [0.25; 45]);
    assert_eq!(rendered.picture.layer("variance").unwrap().values(), [0.0; 45]);
    assert_eq!(rendered.report.technique, "even");
    assert_eq!(rendered.report.samples, [4, 4]);
    assert!(
        rendered
            .report
            .passes
            .iter()
            .any(|pass| pass.name == "even: fill" && pass.count == 4)
    );
    assert_no_messages(&gpu);
}

#[test]
fn a_technique_is_refused_with_the_reason_before_it_is_made() {
    const NEVER: Card = Card {
        create: |_, _, _, _| panic!("made in spite of the refusal"),
        ..EVEN
    };
    let host = Host::new();
    let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
    let sky = Renderer::new(&gpu, &clerestory::scene::load("builtin:box-city?n=2").unwrap()).unwrap();
    let closed = Renderer::new(&gpu, &clerestory::scene::load("builtin:cornell-box").unwrap()).unwrap();
    let refusal = |renderer: &Renderer, info: &Card| {
        let options = RenderOptions::default();
        renderer.start_technique(info, &options).err().expect("a refusal")
    };
    // The host did not enable it.
    let needy = Card {
        needs: &["geometryShader"],
        ..NEVER
    };
    let error = refusal(&sky, &needy);
    assert!(matches!(error, Error::MissingFeature { .. }), "{error}");
    let text = error.to_string();
    for word in [
        "technique even",
        "geometryShader",
        "enable it",
        "run here: path",
        &gpu.caps().device,
    ] {
        assert!(text.contains(word), "{word:?} is not in: {text}");
    }
    let misspelt = Card {
        needs: &["geometryShaders"],
        ..NEVER
    };
    let text = refusal(&sky, &misspelt).to_string();
    assert!(
        text.starts_with("setting needs: geometryShaders") && text.contains("shaderInt64"),
        "{text}"
    );
    let text = refusal(&closed, &NEVER).to_string();
    assert!(text.contains("even") && text.contains("there is no sky"), "{text}");
    drop((sky, closed, gpu));
}

#[test]
fn settings_of_a_hosts_own_come_as_struct_or_json_and_are_checked_by_their_declaration() {
    let host = Host::new();
    let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
    let renderer = Renderer::new(&gpu, &clerestory::scene::load("builtin:box-city?n=2").unwrap()).unwrap();
    let start = |settings: Settings| {
        let options = RenderOptions {
            size: [2, 2],
            settings,
            ..RenderOptions::default()
        };
        renderer.start_technique(&EVEN, &options)
    };
    let brightness = |settings| {
        let mut rendering = start(settings).unwrap();
        while rendering.step().unwrap().is_some() {}
        rendering.picture().unwrap().layer("radiance").unwrap().values()[0]
    };
    let typed = |radiance| EvenSettings { radiance };
    assert_eq!(brightness(Settings::default()), 1.0);
    assert_eq!(brightness(typed(0.5).into()), 0.5);
    assert_eq!(brightness(serde_json::json!({"radiance": 0.5}).into()), 0.5);
    for (settings, words) in [
        (
            typed(-1.0).into(),
            "setting radiance: -1 is out of range; it may be 0 or more (W·m⁻²·sr⁻¹)",
        ),
        (
            serde_json::json!({"radiance": -1.5}).into(),
            "setting radiance: -1.5 is out of range",
        ),
        (
            serde_json::json!({"radiance": "x"}).into(),
            "setting radiance: \"x\" does not fit",
        ),
        (serde_json::json!({"colour": 1}).into(), "there is: radiance"),
        (Settings::of(PathTracerSettings::default()), "EvenSettings"),
    ] {
        let text = start(settings).err().expect("a refusal").to_string();
        assert!(text.contains(words), "{words}: {text}");
    }
    let info = &EVEN.settings.infos()[0];
    assert_eq!(
        (info.name, info.meaning.as_str()),
        ("radiance", "Radiance of every sample")
    );
    drop((renderer, gpu));
}
