use super::files::Source;
use super::{LoadError, Warnings};
use crate::scene::Scene;
pub(super) fn load(_s: &Source, _bytes: &[u8], _w: &mut Warnings) -> Result<Scene, LoadError> {
    todo!()
}
