//! Pictures and functions of kernels at the ends of what scenes can ask for: sizes and places far
//! from 1 and 0, lights of any size, numbers at the ends of their range.
//!
//! Each test here notes the worst that it finds (`record`), by the row of the table of extremes that it
//! belongs to. What holds the rows that are the renderer's:
//!
//! | row | held here | and in |
//! |---|---|---|
//! | 7 impossible indices | `limits` | `tests/diagnostics/parameter_value` |
//! | 11 ends of random numbers | `functions` | `random`, `lights.rs` |
//! | 12 weights of densities | `numbers` | `lights.rs` |
//! | 14 normal maps, tangents | | `surface.rs`, `compiler/tests/stdlib/normals.rs` |
//! | 15 frames | `functions` | |
//! | 16 normals that face away | `pictures` | `compiler/tests/stdlib/bumps.rs` |
//! | 18 triangles without area | `functions` | `scene.rs`, `bvh.rs` |
//! | 19 size and place | `places` | `bvh.rs`, `placed.rs` |
//! | 20 tiny, skinny, distant lights | `functions` | `lights.rs` |
//! | 22 environment maps | `functions` | `environment.rs`, `lights.rs` |
//! | 23, 24 samples, draws, seeds | `numbers` | `random` |
//! | 25 roulette | `pictures` | `furnace` |
//! | 26 white surfaces | `pictures` | `compiler/tests/stdlib` |
//! | 28 sun and sky, sharp lights | `pictures` | `film` |
//! | 29 nearly white rooms | `pictures` | `furnace` |
//! | 30, 31 layers, lobes, loops | `limits` | `tests/diagnostics/lobes`, `loops` |
//! | 32 media | | `media`, `scene` |

mod functions;
mod limits;
mod numbers;
mod oracle;
mod pictures;
mod places;
