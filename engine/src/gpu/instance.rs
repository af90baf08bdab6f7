//! Instance creation, validation layers and the list of devices.

use std::collections::BTreeSet;
use std::ffi::{CStr, CString, c_void};
use std::sync::{Arc, Mutex};

use ash::{ext, khr, vk};

use super::caps::DeviceKind;
use super::options::Validation;
use crate::{Error, Result};

/// One message of the validation layers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValidationMessage {
    /// True for an error, false for a warning.
    pub error: bool,
    /// The message id, such as `VUID-vkCmdDispatch-None-02697`.
    pub id: String,
    /// The layer's text.
    pub text: String,
}

/// Messages so far, shared with the debug callback.
pub(super) type Messages = Arc<Mutex<Vec<ValidationMessage>>>;

/// Messages that outlive their device.
#[derive(Debug, Clone)]
pub struct ValidationLog(pub(super) Messages);

impl ValidationLog {
    /// Takes what has been left so far.
    pub fn take(&self) -> Vec<ValidationMessage> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }
}

/// The Vulkan instance with its debug messenger.
pub(super) struct Instance {
    pub entry: ash::Entry,
    pub raw: ash::Instance,
    pub messages: Messages,
    pub debug_utils: bool,
    /// Resolved: what runs.
    pub validation: Validation,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// False when a host owns the instance.
    owned: bool,
}

/// One physical device, for lists.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct DeviceSummary {
    /// Its index in the loader's order.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// What kind of device it is.
    pub kind: DeviceKind,
    /// Driver name and version.
    pub driver: String,
    /// Vulkan version.
    pub api: String,
}

impl Instance {
    /// Creates an instance with the extensions that the surface wants.
    pub fn new(validation: Validation, surface_extensions: &[&CStr]) -> Result<Self> {
        let validation = validation.resolve()?;
        // SAFETY: the loader stays loaded as long as `Entry` lives, which `Instance` owns.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| Error::NoVulkan(error.to_string()))?;
        // SAFETY: plain query.
        let available = unsafe { entry.enumerate_instance_extension_properties(None) }
            .map_err(vulkan("vkEnumerateInstanceExtensionProperties"))?;
        let available: BTreeSet<CString> = available
            .iter()
            .filter_map(|e| e.extension_name_as_c_str().ok().map(CStr::to_owned))
            .collect();
        let debug_utils = available.contains(ext::debug_utils::NAME) || validation != Validation::Off;
        let mut extensions: Vec<&CStr> = surface_extensions.to_vec();
        if debug_utils {
            extensions.push(ext::debug_utils::NAME);
        }
        let mut layers: Vec<&CStr> = Vec::new();
        if validation != Validation::Off {
            require_validation_layer(&entry)?;
            layers.push(VALIDATION_LAYER);
            extensions.push(ext::validation_features::NAME);
        }
        let messages = Messages::default();
        let mut creation_messenger = messenger_info(&messages);
        let enabled: &[vk::ValidationFeatureEnableEXT] = match validation {
            Validation::Off | Validation::Environment => &[],
            Validation::Core => &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION],
            Validation::GpuAssisted => &[
                vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
                vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
            ],
        };
        // GPU-assisted validation needs the core checks off to stay within reasonable time.
        let disabled: &[vk::ValidationFeatureDisableEXT] = match validation {
            Validation::GpuAssisted => &[vk::ValidationFeatureDisableEXT::CORE_CHECKS],
            _ => &[],
        };
        let mut features = vk::ValidationFeaturesEXT::default()
            .enabled_validation_features(enabled)
            .disabled_validation_features(disabled);
        let application = vk::ApplicationInfo::default()
            .application_name(c"clerestory")
            .engine_name(c"clerestory")
            .api_version(vk::API_VERSION_1_3);
        let layer_names: Vec<_> = layers.iter().map(|name| name.as_ptr()).collect();
        let extension_names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layer_names)
            .enabled_extension_names(&extension_names);
        if validation != Validation::Off {
            info = info.push_next(&mut features).push_next(&mut creation_messenger);
        }
        // SAFETY: every pointer in `info` outlives the call.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => Error::NoVulkan("no driver with Vulkan 1.3".into()),
            other => Error::Vulkan {
                call: "vkCreateInstance",
                result: other,
            },
        })?;
        let mut instance = Self {
            entry,
            raw,
            messages,
            debug_utils,
            validation,
            messenger: None,
            owned: true,
        };
        if validation != Validation::Off {
            let debug = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            let info = messenger_info(&instance.messages);
            // SAFETY: the callback's user data is the message list, which `instance` keeps alive longer than the messenger.
            let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }
                .map_err(vulkan("vkCreateDebugUtilsMessengerEXT"))?;
            instance.messenger = Some((debug, messenger));
        }
        Ok(instance)
    }

    /// Wraps a host's instance, which the host destroys.
    pub fn from_host(entry: ash::Entry, raw: ash::Instance, debug_utils: bool, validation: Validation) -> Self {
        Self {
            entry,
            raw,
            messages: Messages::default(),
            debug_utils,
            validation,
            messenger: None,
            owned: false,
        }
    }

    /// The physical devices in the loader's order.
    pub fn devices(&self) -> Result<Vec<(vk::PhysicalDevice, DeviceSummary)>> {
        // SAFETY: the instance is alive.
        let devices = unsafe { self.raw.enumerate_physical_devices() }.map_err(vulkan("vkEnumeratePhysicalDevices"))?;
        Ok(devices
            .into_iter()
            .enumerate()
            .map(|(index, device)| (device, self.summary(index, device)))
            .collect())
    }

    /// Name, kind and driver of a device.
    pub fn summary(&self, index: usize, device: vk::PhysicalDevice) -> DeviceSummary {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: `device` belongs to this instance; drivers below Vulkan 1.2 leave the chained struct as it is.
        unsafe { self.raw.get_physical_device_properties2(device, &mut properties) };
        let properties = properties.properties;
        let text = |chars: &[std::ffi::c_char]| {
            let bytes: Vec<u8> = chars.iter().take_while(|c| **c != 0).map(|c| *c as u8).collect();
            String::from_utf8_lossy(&bytes).into_owned()
        };
        let version = properties.api_version;
        DeviceSummary {
            index,
            name: text(&properties.device_name),
            kind: DeviceKind::of(properties.device_type),
            driver: format!("{} {}", text(&driver.driver_name), text(&driver.driver_info))
                .trim()
                .to_owned(),
            api: format!(
                "{}.{}.{}",
                vk::api_version_major(version),
                vk::api_version_minor(version),
                vk::api_version_patch(version)
            ),
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((debug, messenger)) = self.messenger.take() {
            // SAFETY: created by this instance and destroyed once.
            unsafe { debug.destroy_debug_utils_messenger(messenger, None) };
        }
        if self.owned {
            // SAFETY: every object made from the instance holds an `Arc` to it, so none is left.
            unsafe { self.raw.destroy_instance(None) };
        }
    }
}

/// The layer that [`Validation`] switches on.
pub const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

fn require_validation_layer(entry: &ash::Entry) -> Result<()> {
    // SAFETY: plain query.
    let layers =
        unsafe { entry.enumerate_instance_layer_properties() }.map_err(vulkan("vkEnumerateInstanceLayerProperties"))?;
    if layers
        .iter()
        .any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER))
    {
        return Ok(());
    }
    Err(Error::MissingFeature {
        feature: VALIDATION_LAYER.to_string_lossy().into_owned(),
        needed_by: "validation".into(),
        device: "the Vulkan loader".into(),
        instead: "install it (Debian: vulkan-validationlayers) or switch validation off".into(),
    })
}

/// Messages that say nothing about this engine's use of Vulkan.
const IGNORED: [&str; 2] = [
    // The layer's own remark that GPU-assisted validation switched a feature on for itself.
    "UNASSIGNED-GPU-Assisted Validation Setup Error",
    "UNASSIGNED-GPU-Assisted",
];

/// A warning that older layers give of shader outputs whose attachment is `UNDEFINED`. By the specification what is written there is
/// discarded.
const UNUSED_OUTPUT: [&str; 2] = [
    "UNASSIGNED-CoreValidation-Shader-InterfaceTypeMismatch",
    "of type `VK_FORMAT_UNDEFINED` does not match fragment shader output type",
];

fn is_ignored(id: &str, text: &str) -> bool {
    let [unused, words] = UNUSED_OUTPUT;
    IGNORED.contains(&id) || (id == unused && text.contains(words))
}

fn messenger_info(messages: &Messages) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE)
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(messages).cast_mut().cast())
}

unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid callback data, and `user` is the `Mutex` inside an `Arc` that the instance keeps alive.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Mutex<Vec<ValidationMessage>>>()) };
    // SAFETY: both strings are null or NUL-terminated for the time of the call.
    let (id, text) = unsafe {
        let read = |text: *const std::ffi::c_char| {
            if text.is_null() {
                String::new()
            } else {
                CStr::from_ptr(text).to_string_lossy().into_owned()
            }
        };
        (read(data.p_message_id_name), read(data.p_message))
    };
    let error = severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR);
    if error || !is_ignored(&id, &text) {
        tracing::warn!(%id, "{text}");
        if let Ok(mut list) = messages.lock() {
            list.push(ValidationMessage { error, id, text });
        }
    }
    vk::FALSE
}

/// Turns a result code into an [`Error::Vulkan`] of that call.
pub(super) fn vulkan(call: &'static str) -> impl Fn(vk::Result) -> Error {
    move |result| Error::Vulkan { call, result }
}

/// Instance extensions that a window system's surfaces need.
pub(super) fn surface_extensions(display: raw_window_handle::RawDisplayHandle) -> Result<Vec<&'static CStr>> {
    let names = ash_window::enumerate_required_extensions(display).map_err(|_| Error::MissingFeature {
        feature: khr::surface::NAME.to_string_lossy().into_owned(),
        needed_by: "a window".into(),
        device: "this window system".into(),
        instead: "render headless".into(),
    })?;
    // SAFETY: ash-window returns pointers to static, NUL-terminated names.
    Ok(names.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect())
}
