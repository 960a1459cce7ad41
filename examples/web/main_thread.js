// SPDX-License-Identifier: MIT
// Linked into the engine. Emscripten warns in the console where the main thread joins another: the page's does so when
// a bone is closed, for the tick that goes on, a millisecond, and no thread of ours ever waits for the main one.
mergeInto(LibraryManager.library, {
  emscripten_check_blocking_allowed: () => {},
});
