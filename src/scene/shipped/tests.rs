//! The shipped scenes are what they claim to be.
