//! What every generated scene keeps to.

use super::*;
