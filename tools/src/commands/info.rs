//! `clerestory info`: the devices of this machine, or what is in a scene and which techniques can render it.

use std::fmt::Write as _;
use std::process::ExitCode;

use clap::Args;
use clerestory::gpu::{Caps, DeviceSelection, DeviceSummary, Gpu, GpuOptions};
use clerestory::input::InputFile;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{self, Camera, LoadOptions, Projection, Scene, SceneProfile};
use clerestory::techniques::{self, Card, Lack};

use super::check_validation;
use crate::failure::{Code, Failure, Outcome};
use crate::options::DeviceOptions;
use crate::output::{self, Stream};

/// Shows the devices of this machine; with a scene, what it holds and which techniques can render it
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory info                          devices, limits, and what each technique needs of them
  clerestory info builtin:cornell-box      profile, cameras, the reader's notes, techniques
  clerestory info model.gltf --files       also the files that the scene has read
  clerestory info --device lavapipe        one device
  clerestory info --json | jq '.devices[].name'

A scene may name every file that you may read, by absolute paths, `..` and links, and what it shows of them (bounds, counts, pictures) says what is \
in them. --files lists what a scene has read; hosts can keep scenes in a folder (clerestory::scene::load_with).")]
pub struct Arguments {
    /// A scene file or `builtin:` address
    #[arg(conflicts_with_all = ["device", "validation"])]
    scene: Option<String>,
    /// Also lists the files that the scene has read, with their lengths
    #[arg(long, requires = "scene")]
    files: bool,
    /// Prints JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    device: DeviceOptions,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    match &arguments.scene {
        Some(address) => {
            let loaded = scene::load_with(address, &LoadOptions::default()).map_err(Failure::scene)?;
            let info = SceneInfo {
                files: arguments.files.then_some(loaded.files),
                ..SceneInfo::of(&loaded.scene)
            };
            if arguments.json {
                output::print_json(&info)?;
            } else {
                output::print(&info.text())?;
            }
        }
        None => {
            let wanted = arguments.device.options();
            let all = Gpu::list()?;
            let names: Vec<String> = all.iter().map(|(s, _)| format!("{}: {}", s.index, s.name)).collect();
            let devices = all.into_iter().filter(|(summary, _)| wanted.device.matches(summary));
            let devices: Vec<DeviceInfo> = devices.map(|device| DeviceInfo::of(device, &wanted)).collect();
            if devices.is_empty() && !names.is_empty() {
                let wanted = arguments.device.device.as_deref().unwrap_or_default();
                return Err(Failure {
                    code: Code::NoDevice,
                    message: format!("no Vulkan device is called or numbered {wanted:?}"),
                    hint: Some(format!("there is {}", names.join(", "))),
                });
            }
            if arguments.json {
                output::print_json(&serde_json::json!({ "devices": devices }))?;
            } else {
                let texts: Vec<String> = devices.iter().map(DeviceInfo::text).collect();
                output::print(&texts.join("\n"))?;
            }
            if devices.is_empty() {
                return Err(Failure {
                    code: Code::NoDevice,
                    message: "there is no Vulkan device".into(),
                    hint: Some("install a driver (Debian: mesa-vulkan-drivers has one in software)".into()),
                });
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A device and what can run on it.
#[derive(serde::Serialize)]
struct DeviceInfo {
    #[serde(flatten)]
    summary: DeviceSummary,
    /// Why the engine cannot use it; `None` when it can.
    unusable: Option<String>,
    caps: Caps,
    techniques: Vec<TechniqueNeeds>,
}

#[derive(serde::Serialize)]
struct TechniqueNeeds {
    id: &'static str,
    needs: Vec<Need>,
    /// Why it cannot be made here even for one of [`PROBES`], by its default settings; `None` when it can, or the device is unusable.
    fault: Option<String>,
    /// Features and limits that the device does not have.
    lacks: Vec<Lack>,
}

#[derive(serde::Serialize)]
struct Need {
    feature: &'static str,
    /// `None` when the program cannot tell.
    present: Option<bool>,
}

/// Scenes that techniques are made for, each for the first that it can render, to see whether a device's limits hold all of their kernels.
const PROBES: [&str; 3] = [
    "builtin:furnace-box",
    "builtin:cornell-box?source=point",
    "builtin:triangle-soup?n=8",
];

/// Why a device cannot be made or used, and each technique's fault on it; the validation layers are heard when the options ask for them.
fn faults_of(options: &GpuOptions) -> (Option<String>, Vec<Option<String>>) {
    let gpu = match Gpu::headless(options) {
        Ok(gpu) => gpu,
        Err(error) => return (Some(error.to_string()), Vec::new()),
    };
    let words = |error: clerestory::Error| error.to_string();
    let probe = |address: &&str| {
        scene::load(address)
            .and_then(|scene| Renderer::new(&gpu, &scene))
            .map_err(words)
    };
    let probes: Result<Vec<Renderer>, String> = PROBES.iter().map(probe).collect();
    let fault = |card: &Card| match &probes {
        Ok(probes) => fault_of(probes, card).err().map(words),
        Err(error) => Some(error.clone()),
    };
    let faults = techniques::all().iter().map(fault).collect();
    drop(probes);
    let log = gpu.validation_log();
    drop(gpu);
    (check_validation(&log).err().map(|failure| failure.message), faults)
}

/// Makes a technique for the first of the probes that it does not refuse.
fn fault_of(probes: &[Renderer], card: &Card) -> clerestory::Result<()> {
    let able = probes
        .iter()
        .find(|probe| (card.refusals)(probe.gpu_scene().profile()).is_empty());
    let options = RenderOptions {
        technique: Some(card.id.into()),
        size: [8, 8],
        spp: 1,
        ..RenderOptions::default()
    };
    able.map_or(Ok(()), |probe| probe.start(&options).map(drop))
}

impl DeviceInfo {
    fn of((summary, caps): (DeviceSummary, Caps), wanted: &GpuOptions) -> Self {
        let options = GpuOptions {
            device: DeviceSelection::Index(summary.index),
            cache_folder: None,
            ..wanted.clone()
        };
        let need = |feature: &&'static str| Need {
            feature,
            present: techniques::offers(&caps, feature),
        };
        let (unusable, faults) = faults_of(&options);
        let faults = faults.into_iter().chain(std::iter::repeat(None));
        Self {
            unusable,
            techniques: techniques::all()
                .iter()
                .zip(faults)
                .map(|(technique, fault)| TechniqueNeeds {
                    id: technique.id,
                    needs: technique.needs.iter().map(need).collect(),
                    fault,
                    lacks: techniques::lacks(&caps, technique),
                })
                .collect(),
            summary,
            caps,
        }
    }

    fn text(&self) -> String {
        let (summary, caps) = (&self.summary, &self.caps);
        let mut lines = vec![
            output::bold(&format!("{}: {}", summary.index, output::one_line(&summary.name))),
            match &self.unusable {
                None => "  usable       yes".into(),
                Some(cause) => output::red(
                    &format!("  usable       no: {}", output::one_line(cause)),
                    Stream::Output,
                ),
            },
            format!("  kind         {}", summary.kind),
            format!("  driver       {}", output::one_line(&summary.driver)),
            format!("  Vulkan       {}", summary.api),
        ];
        let operations = [
            ("basic", caps.subgroup.basic),
            ("vote", caps.subgroup.vote),
            ("arithmetic", caps.subgroup.arithmetic),
            ("ballot", caps.subgroup.ballot),
            ("shuffle", caps.subgroup.shuffle),
        ];
        lines.push(format!(
            "  subgroup     {} lanes, at least {}{}: {}",
            caps.subgroup_size,
            caps.min_subgroup_size,
            if caps.full_subgroups { ", full" } else { "" },
            names(&operations)
        ));
        let features = FEATURES.map(|name| (name, techniques::offers(caps, name) == Some(true)));
        lines.push(format!("  features     {}", names(&features)));
        lines.push(if caps.ray_query {
            "  ray indexes  all, driver too".into()
        } else {
            "  ray indexes  all but driver, for want of VK_KHR_ray_query".into()
        });
        lines.push(format!(
            "  memory       {} heap, {} per allocation, {} per storage buffer, {} texels per texel buffer",
            output::bytes(caps.device_heap),
            output::bytes(caps.max_allocation_size),
            output::bytes(caps.max_storage_buffer_range),
            caps.max_texel_buffer_elements
        ));
        lines.push(format!(
            "  compute      {} invocations per workgroup, {} shared, {} workgroups, {} of push constants",
            caps.max_workgroup_invocations,
            output::bytes(u64::from(caps.max_shared_memory)),
            caps.max_workgroups[0],
            output::bytes(u64::from(caps.max_push_constants))
        ));
        lines.push(if caps.timestamp_period > 0.0 {
            format!("  timestamps   {} ns", caps.timestamp_period)
        } else {
            "  timestamps   none: passes are not timed".into()
        });
        for technique in &self.techniques {
            let needs: Vec<String> = technique
                .needs
                .iter()
                .map(|need| {
                    let answer = match need.present {
                        Some(true) => "has it",
                        Some(false) => "lacks it",
                        None => "unknown",
                    };
                    format!("{} ({answer})", need.feature)
                })
                .collect();
            let needs = match (needs.is_empty(), technique.lacks.is_empty()) {
                (true, true) => "nothing beyond the engine's baseline".into(),
                (true, false) => "more than the device offers".into(),
                (false, _) => needs.join(", "),
            };
            lines.push(format!("  technique    {} needs {needs}", technique.id));
            if let Some(fault) = &technique.fault {
                let text = format!(
                    "  technique    {} cannot run: {}",
                    technique.id,
                    output::one_line(fault)
                );
                lines.push(output::red(&text, Stream::Output));
            }
            lines.extend(technique.lacks.iter().filter_map(limit_text));
        }
        lines.join("\n") + "\n"
    }
}

/// A limit that is too low, in a line of its own; features are said among the needs.
fn limit_text(lack: &Lack) -> Option<String> {
    let offered = lack.offered?;
    Some(output::red(
        &format!(
            "               lacks {} (it offers {offered}) for {}",
            lack.what,
            lack.kernels.join(", ")
        ),
        Stream::Output,
    ))
}

/// Device features shown of every device, by their Vulkan names.
const FEATURES: [&str; 11] = [
    "geometryShader",
    "shaderClipDistance",
    "shaderInt64",
    "shaderFloat64",
    "shaderBufferInt64Atomics",
    "robustBufferAccess",
    "pipelineStatisticsQuery",
    "fragmentStoresAndAtomics",
    "vertexPipelineStoresAndAtomics",
    "VK_KHR_ray_query",
    "runtimeDescriptorArray",
];

fn names(list: &[(&str, bool)]) -> String {
    let there: Vec<&str> = list.iter().filter(|(_, there)| *there).map(|(name, _)| *name).collect();
    if there.is_empty() {
        "none".into()
    } else {
        there.join(", ")
    }
}

/// A scene and who can render it.
#[derive(serde::Serialize)]
struct SceneInfo {
    name: String,
    source: String,
    aspect: Option<f32>,
    exposure: f32,
    technique: Option<String>,
    profile: SceneProfile,
    cameras: Vec<CameraInfo>,
    notes: Vec<scene::Note>,
    techniques: Vec<TechniqueVerdict>,
    /// What was read, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<Vec<InputFile>>,
}

#[derive(serde::Serialize)]
struct CameraInfo {
    name: String,
    /// Metres.
    position: [f64; 3],
    /// Full vertical field of view, degrees; `None` for orthographic cameras.
    fov_y: Option<f32>,
    /// Half the height seen by an orthographic camera, metres.
    half_height: Option<f32>,
    /// Metres; 0 is a pinhole.
    lens_radius: f32,
    /// Metres.
    focus_distance: f32,
}

#[derive(serde::Serialize)]
struct TechniqueVerdict {
    id: &'static str,
    /// Why it cannot render the scene; empty when it can.
    refusals: Vec<String>,
}

impl CameraInfo {
    fn of(camera: &Camera) -> Self {
        let (fov_y, half_height) = match camera.projection {
            Projection::Perspective { fov_y } => (Some(fov_y.to_degrees()), None),
            Projection::Orthographic { half_height } => (None, Some(half_height)),
        };
        Self {
            name: camera.name.clone(),
            position: camera.transform.translation.to_array(),
            fov_y,
            half_height,
            lens_radius: camera.lens_radius,
            focus_distance: camera.focus_distance,
        }
    }

    fn text(&self) -> String {
        let [x, y, z] = self.position;
        let mut text = format!("{} at {x:.3} {y:.3} {z:.3} m", self.name);
        // Writing to a string cannot fail.
        let _ = match (self.fov_y, self.half_height) {
            (Some(degrees), _) => write!(text, ", {degrees:.1}° high"),
            (None, Some(half)) => write!(text, ", orthographic, {:.3} m high", 2.0 * half),
            (None, None) => Ok(()),
        };
        if self.lens_radius > 0.0 {
            let _ = write!(
                text,
                ", lens radius {} m, in focus at {} m",
                self.lens_radius, self.focus_distance
            );
        }
        text
    }
}

impl SceneInfo {
    fn of(scene: &Scene) -> Self {
        let profile = SceneProfile::of(scene);
        Self {
            name: scene.name.clone(),
            source: scene.source.clone(),
            aspect: scene.defaults.aspect,
            exposure: scene.defaults.exposure,
            technique: scene.defaults.technique.clone(),
            cameras: scene.cameras.iter().map(CameraInfo::of).collect(),
            notes: scene.notes.clone(),
            techniques: techniques::all()
                .iter()
                .map(|technique| TechniqueVerdict {
                    id: technique.id,
                    refusals: (technique.refusals)(&profile),
                })
                .collect(),
            profile,
            files: None,
        }
    }

    fn text(&self) -> String {
        let mut lines = vec![output::bold(&output::one_line(&self.source))];
        lines.extend(self.profile.to_string().lines().map(str::to_owned));
        if let Some(aspect) = self.aspect {
            lines.push(format!("aspect        {aspect} (width over height)"));
        }
        if self.exposure != 0.0 {
            lines.push(format!("exposure      {} stops", self.exposure));
        }
        lines.extend(
            self.cameras
                .iter()
                .map(|camera| format!("camera        {}", output::one_line(&camera.text()))),
        );
        lines.extend(self.techniques.iter().map(|technique| {
            if technique.refusals.is_empty() {
                format!("technique     {} can render it", technique.id)
            } else {
                format!(
                    "technique     {} cannot: {}",
                    technique.id,
                    technique.refusals.join("; ")
                )
            }
        }));
        lines.extend(self.notes.iter().map(|note| {
            let text = format!("note          {} ({}): {}", note.feature, note.at, note.instead);
            output::one_line(&text)
        }));
        lines.extend(self.files.iter().flatten().map(|file| {
            let text = format!("file          {} ({} bytes)", file.path.display(), file.bytes);
            output::one_line(&text)
        }));
        if self.files.as_ref().is_some_and(Vec::is_empty) {
            lines.push("file          none".into());
        }
        lines.join("\n") + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clerestory::gpu::{DescriptorLimits, Lesser};

    #[test]
    fn what_a_device_of_small_limits_lacks_is_named() {
        let usual = Gpu::headless(&GpuOptions::default()).unwrap().caps().descriptors;
        let with = |storage_buffers| {
            let descriptors = DescriptorLimits {
                per_stage_storage_buffers: storage_buffers,
                ..usual
            };
            faults_of(&GpuOptions {
                lesser: Lesser {
                    descriptors: Some(descriptors),
                    ..Lesser::default()
                },
                ..GpuOptions::default()
            })
        };
        let (unusable, faults) = with(usual.per_stage_storage_buffers);
        assert_eq!((unusable, faults), (None, vec![None; techniques::all().len()]));
        // A kernel of the walk has more than two.
        let (unusable, faults) = with(2);
        assert_eq!(unusable, None);
        assert_eq!(faults.len(), techniques::all().len());
        for (technique, fault) in techniques::all().iter().zip(faults) {
            let fault = fault.unwrap_or_default();
            let mut kernels = technique.kernels.iter().copied().flatten();
            let walks = kernels.any(|kernel| kernel.name.starts_with("walk/"));
            assert!(
                fault.contains("maxPerStageDescriptorStorageBuffers >= ") || (!walks && fault.is_empty()),
                "{}: {fault}",
                technique.id
            );
        }
    }
}
