//! Small programs that each show one use of the Clerestory rendering engine.
