//! Open bugs, each a test of what should be, marked `#[should_panic]` until it is. None is known.
