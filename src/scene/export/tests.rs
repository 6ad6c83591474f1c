//! The file says what the scene says.
