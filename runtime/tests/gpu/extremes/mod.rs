//! Pictures and functions of kernels at the ends of what scenes can ask for: sizes and places far
//! from 1 and 0, lights of any size, numbers at the ends of their range.

mod functions;
mod limits;
mod numbers;
mod oracle;
mod pictures;
mod places;
