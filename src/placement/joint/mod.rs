//! wip
/// What the rest of the chain is worth.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Outlook { parts: [f32; 17] }
impl Outlook {
    /// .
    pub fn parts(&self) -> [f32; 17] { self.parts }
    /// .
    pub fn from_parts(parts: [f32; 17]) -> Option<Self> { parts.iter().all(|p| p.is_finite()).then_some(Self { parts }) }
}
mod hop;
mod model;
pub mod proto;
