//! Functions that wide code calls. Each finds its arguments as cells of eight lanes, and leaves its results
//! behind them.

use std::ffi::c_void;
use std::sync::atomic::{AtomicU32, Ordering};

use naga::MathFunction as Math;

use crate::arithmetic::Called;
use crate::cell::Cell;

/// Answers a call in place of the kernel's function, in the lanes of the first cell that are not 0: the
/// cells of its arguments follow, and then those of its result.
pub(super) type Answer = unsafe extern "C" fn(data: *const c_void, cells: *mut Cell);

macro_rules! floats {
    ($($name:ident: $function:expr),+ $(,)?) => {
        $(#[allow(unsafe_code)]
        unsafe extern "C" fn $name(_: *const c_void, cells: *mut Cell) {
            // SAFETY: the code that calls leaves one cell and has room for another.
            let cells = unsafe { &mut *cells.cast::<[Cell; 2]>() };
            let [Cell(x), Cell(y)] = cells;
            let function: fn(f32) -> f32 = $function;
            for (y, x) in y.iter_mut().zip(x) {
                *y = function(f32::from_bits(*x)).to_bits();
            }
        })+
    };
}

floats! {
    cos: f32::cos, cosh: f32::cosh, sin: f32::sin, sinh: f32::sinh, tan: f32::tan, tanh: f32::tanh,
    acos: f32::acos, asin: f32::asin, atan: f32::atan, asinh: f32::asinh, acosh: f32::acosh,
    atanh: f32::atanh, exp: f32::exp, exp2: f32::exp2, log: f32::ln, log2: f32::log2,
    to_half_and_back: |x| half::f16::from_f32(x).to_f32(),
}

macro_rules! words {
    ($($name:ident: $function:expr),+ $(,)?) => {
        $(#[allow(unsafe_code)]
        pub(super) unsafe extern "C" fn $name(_: *const c_void, cells: *mut Cell) {
            // SAFETY: the code that calls leaves one cell and has room for another.
            let cells = unsafe { &mut *cells.cast::<[Cell; 2]>() };
            let [Cell(x), Cell(y)] = cells;
            let function: fn(u32) -> u32 = $function;
            for (y, x) in y.iter_mut().zip(x) {
                *y = function(*x);
            }
        })+
    };
}

words! {
    ones: u32::count_ones,
    leading_zeros: u32::leading_zeros,
    trailing_zeros: u32::trailing_zeros,
    half_bits: |x| half::f16::from_f32(f32::from_bits(x)).to_bits().into(),
}

macro_rules! pairs {
    ($($name:ident: $function:expr),+ $(,)?) => {
        $(#[allow(unsafe_code)]
        pub(super) unsafe extern "C" fn $name(_: *const c_void, cells: *mut Cell) {
            // SAFETY: the code that calls leaves two cells and has room for another.
            let cells = unsafe { &mut *cells.cast::<[Cell; 3]>() };
            let [Cell(a), Cell(b), Cell(y)] = cells;
            let function: fn(u32, u32) -> u32 = $function;
            for (y, (a, b)) in y.iter_mut().zip(a.iter().zip(b)) {
                *y = function(*a, *b);
            }
        })+
    };
}

fn of_floats(a: u32, b: u32, function: fn(f32, f32) -> f32) -> u32 {
    function(f32::from_bits(a), f32::from_bits(b)).to_bits()
}

pairs! {
    quotient: |a, b| a.checked_div(b).unwrap_or(0),
    rest: |a, b| a.checked_rem(b).unwrap_or(0),
    quotient_signed: |a, b| (a as i32).wrapping_div(if b == 0 { 1 } else { b as i32 }) as u32,
    rest_signed: |a, b| (a as i32).wrapping_rem(if b == 0 { 1 } else { b as i32 }) as u32,
    pow: |a, b| of_floats(a, b, f32::powf),
    atan2: |a, b| of_floats(a, b, f32::atan2),
    remainder: |a, b| of_floats(a, b, |x, y| x % y),
}

/// The address of a function that is called.
pub(super) fn address(function: Called) -> usize {
    let found: Answer = match function {
        Called::Remainder => remainder,
        Called::HalfBits => half_bits,
        Called::Two(Math::Pow) => pow,
        Called::Two(_) => atan2,
        Called::One(Math::Cos) => cos,
        Called::One(Math::Cosh) => cosh,
        Called::One(Math::Sin) => sin,
        Called::One(Math::Sinh) => sinh,
        Called::One(Math::Tan) => tan,
        Called::One(Math::Tanh) => tanh,
        Called::One(Math::Acos) => acos,
        Called::One(Math::Asin) => asin,
        Called::One(Math::Atan) => atan,
        Called::One(Math::Asinh) => asinh,
        Called::One(Math::Acosh) => acosh,
        Called::One(Math::Atanh) => atanh,
        Called::One(Math::Exp) => exp,
        Called::One(Math::Exp2) => exp2,
        Called::One(Math::Log) => log,
        Called::One(Math::Log2) => log2,
        Called::One(_) => to_half_and_back,
    };
    found as usize
}

/// What an atomic operation leaves.
#[derive(Clone, Copy, Debug)]
pub(super) enum AtomicKind {
    Add,
    Subtract,
    And,
    Or,
    Xor,
    Least,
    LeastSigned,
    Greatest,
    GreatestSigned,
    Exchange,
    Claim,
}

impl AtomicKind {
    pub(super) fn function(self) -> usize {
        let found: Answer = match self {
            AtomicKind::Add => add,
            AtomicKind::Subtract => subtract,
            AtomicKind::And => and,
            AtomicKind::Or => or,
            AtomicKind::Xor => xor,
            AtomicKind::Least => least,
            AtomicKind::LeastSigned => least_signed,
            AtomicKind::Greatest => greatest,
            AtomicKind::GreatestSigned => greatest_signed,
            AtomicKind::Exchange => exchange,
            AtomicKind::Claim => claim,
        };
        found as usize
    }
}

/// # Safety
/// The code that calls leaves four cells and has room for another, and indices are within the buffer.
#[allow(unsafe_code)]
unsafe fn each(data: *const c_void, cells: *mut Cell, function: impl Fn(&AtomicU32, u32) -> u32) {
    // SAFETY: as above.
    unsafe {
        let [
            Cell(mask),
            Cell(index),
            Cell(offset),
            Cell(value),
            Cell(old),
        ] = &mut *cells.cast::<[Cell; 5]>();
        let buffer = data.cast::<AtomicU32>();
        for lane in 0..8 {
            if mask[lane] != 0 {
                let word = &*buffer.add((index[lane] + offset[lane]) as usize);
                old[lane] = function(word, value[lane]);
            }
        }
    }
}

macro_rules! atomics {
    ($($name:ident: $function:expr),+ $(,)?) => {
        $(#[allow(unsafe_code)]
        unsafe extern "C" fn $name(data: *const c_void, cells: *mut Cell) {
            // SAFETY: as `each` says.
            unsafe { each(data, cells, $function) };
        })+
    };
}

const ORDER: Ordering = Ordering::Relaxed;

atomics! {
    subtract: |word, x| word.fetch_sub(x, ORDER),
    and: |word, x| word.fetch_and(x, ORDER),
    or: |word, x| word.fetch_or(x, ORDER),
    xor: |word, x| word.fetch_xor(x, ORDER),
    least: |word, x| word.fetch_min(x, ORDER),
    greatest: |word, x| word.fetch_max(x, ORDER),
    least_signed: |word, x| {
        let least = |now| Some((now as i32).min(x as i32) as u32);
        word.fetch_update(ORDER, ORDER, least).unwrap_or_default()
    },
    greatest_signed: |word, x| {
        let greatest = |now| Some((now as i32).max(x as i32) as u32);
        word.fetch_update(ORDER, ORDER, greatest).unwrap_or_default()
    },
    exchange: |word, x| word.swap(x, ORDER),
    claim: |word, x| word.compare_exchange(0, x, ORDER, ORDER).unwrap_or_else(|now| now),
}

/// Adds. Lanes that add to one word do so at once, as if one after the other.
#[allow(unsafe_code)]
unsafe extern "C" fn add(data: *const c_void, cells: *mut Cell) {
    // SAFETY: as `each` says.
    unsafe {
        let [
            Cell(mask),
            Cell(index),
            Cell(offset),
            Cell(value),
            Cell(old),
        ] = &mut *cells.cast::<[Cell; 5]>();
        let mut first = 8;
        for lane in (0..8).rev() {
            if mask[lane] != 0 {
                first = lane;
            }
        }
        if first == 8 {
            return;
        }
        let place = index[first];
        let mut different = 0;
        for lane in 0..8 {
            different |= (index[lane] ^ place) & mask[lane];
        }
        if different != 0 {
            return each(data, cells, |word, x| word.fetch_add(x, ORDER));
        }
        let word = &*data.cast::<AtomicU32>().add((place + offset[0]) as usize);
        let mut sum = 0u32;
        for lane in 0..8 {
            old[lane] = sum;
            sum = sum.wrapping_add(value[lane] & mask[lane]);
        }
        let before = word.fetch_add(sum, ORDER);
        for old in old {
            *old = old.wrapping_add(before);
        }
    }
}
