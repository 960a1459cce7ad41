// SPDX-License-Identifier: MIT
// Names that Unreal Engine defines as macros.
#pragma once

#define check(expression) ((void)(expression))
#define checkf(expression, format, ...) ((void)(expression))
#define checkCode(code) ((void)0)
#define checkNoEntry() ((void)0)
#define checkSlow(expression) ((void)0)
#define verify(expression) ((void)(expression))
#define verifyf(expression, format, ...) ((void)(expression))
#define ensure(expression) (!!(expression))
#define ensureMsgf(expression, format, ...) (!!(expression))
#define ensureAlways(expression) (!!(expression))
#define unimplemented() ((void)0)
#define TEXT(x) L##x
#define PI (3.1415926535897932f)
#define SMALL_NUMBER (1.e-8f)
#define KINDA_SMALL_NUMBER (1.e-4f)
#define BIG_NUMBER (3.4e+38f)
#define FORCEINLINE inline
#define FORCENOINLINE
#define RESTRICT
#define LIKELY(x) (!!(x))
#define UNLIKELY(x) (!!(x))
#define INDEX_NONE (-1)
#define LOCTEXT(key, text) text
#define CA_SUPPRESS(number)
