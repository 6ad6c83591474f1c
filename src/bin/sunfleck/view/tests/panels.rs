//! Panels, menus, messages, dropped files.
