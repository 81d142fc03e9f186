//! What the validation layer says.

use ash::{ext::debug_utils, vk};
use std::ffi::{CStr, c_char, c_void};
use std::sync::{Arc, Mutex, PoisonError};

/// Receives the layer's warnings and errors.
pub(super) struct Messages {
    debug: debug_utils::Instance,
    messenger: vk::DebugUtilsMessengerEXT,
    // Shared with the layer, which keeps its address.
    kept: Arc<Mutex<Vec<String>>>,
}

impl Messages {
    pub(super) fn new(entry: &ash::Entry, instance: &ash::Instance) -> ash::prelude::VkResult<Self> {
        let kept = Arc::new(Mutex::new(Vec::new()));
        let debug = debug_utils::Instance::new(entry, instance);
        let severity = vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR;
        let kinds = vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE;
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(severity)
            .message_type(kinds)
            .pfn_user_callback(Some(receive))
            .user_data(Arc::as_ptr(&kept).cast_mut().cast());
        // SAFETY: `kept` lives as long as the messenger.
        let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }?;
        Ok(Self { debug, messenger, kept })
    }

    /// What has come in since the last call.
    pub(super) fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Drop for Messages {
    fn drop(&mut self) {
        // SAFETY: the instance still exists; no call is under way.
        unsafe { self.debug.destroy_debug_utils_messenger(self.messenger, None) }
    }
}

/// # Safety
/// Called by the layer with valid pointers, `kept` being what [`Messages::new`] gave it.
unsafe extern "system" fn receive(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    kept: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: see above.
    let (id, text, kept) = unsafe {
        let data = &*data;
        let string = |p: *const c_char| if p.is_null() { c"" } else { CStr::from_ptr(p) }.to_string_lossy();
        (string(data.p_message_id_name), string(data.p_message), &*kept.cast::<Mutex<Vec<String>>>())
    };
    kept.lock().unwrap_or_else(PoisonError::into_inner).push(format!("{id}: {text}"));
    vk::FALSE
}
