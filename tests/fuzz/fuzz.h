/* The readers of what comes from outside, each as a function of bytes. tests/fuzz/main.c gives one of them to libFuzzer
 * (make fuzz); tests/test_corpus.c replays the inputs in tests/corpus/NAME. What an input may not do is crash, hang or
 * read what it should not. */
#ifndef FUZZ_H
#define FUZZ_H
#include <stddef.h>
#include <stdint.h>

void fuzz_safetensors(const uint8_t *data, size_t size); /* a weights file of that form */
void fuzz_torch(const uint8_t *data, size_t size);       /* a weights file of any form */
void fuzz_photo(
    const uint8_t *data,
    size_t size); /* PNG and JPEG by the quick readers, and their colours; a PNG's checksums are put right first */
void fuzz_image(
    const uint8_t *data,
    size_t size); /* by OpenImageIO: the first byte chooses the file name's extension, the rest is the file */
void fuzz_config(const uint8_t *data, size_t size); /* a training configuration */
void fuzz_folder(const uint8_t *data,
                 size_t size); /* the first byte chooses set.ini, meta.txt or one of a capture's files */

/* An existing folder for files that need a name; set it before the last two. */
extern const char *fuzz_where;
/* A path at which the bytes can be read as a file, until the next call. */
const char *fuzz_file(const uint8_t *data, size_t size);
/* The same in fuzz_where under that name. */
const char *fuzz_named(const char *name, const uint8_t *data, size_t size);
#endif
