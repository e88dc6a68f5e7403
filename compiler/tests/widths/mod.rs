//! `filter_width`: derivatives against finite differences in double precision, operation by
//! operation and through everything that a material may do; and what code comes of them.

mod code;
mod flow;
mod ops;
