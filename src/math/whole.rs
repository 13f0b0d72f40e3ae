//! Vectors of integers, for exact geometric tests.

/// The vector from one place to another.
pub(crate) fn vector(from: [i32; 2], to: [i32; 2]) -> [i64; 2] {
    [i64::from(to[0]) - i64::from(from[0]), i64::from(to[1]) - i64::from(from[1])]
}

/// The cross product: above zero if `b` lies on the side of `a` to which x turns to reach y.
pub(crate) const fn cross(a: [i64; 2], b: [i64; 2]) -> i64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The dot product: above zero if the angle between the two is less than a right angle.
pub(crate) const fn dot(a: [i64; 2], b: [i64; 2]) -> i64 {
    a[0] * b[0] + a[1] * b[1]
}
