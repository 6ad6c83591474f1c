//! HDR
use super::LoadError;
use crate::scene::Environment;
use std::path::Path;
/// x
pub fn load_environment(_path: &Path) -> Result<Environment, LoadError> {
    todo!()
}
