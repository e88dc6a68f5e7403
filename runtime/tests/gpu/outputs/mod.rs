//! Outputs of the film beside the picture: every one against what is known of a small scene, exact whatever
//! the plan and however a render is parted, and without an effect on the picture.

mod files;
mod first_hit;
mod studio;
mod sums;
