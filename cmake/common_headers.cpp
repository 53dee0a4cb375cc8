// Empty: a library needs a source to compile its precompiled header with.
