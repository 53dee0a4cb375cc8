// Says where books of notes lie, and reads and writes them, so that no reader sees half a book and no bad file is
// overwritten.
#pragma once

#include <functional>
#include <string>

#include "client/notes/book.h"

namespace telesplat::notes {

/// The files of a data set's book.
struct Shelf {
  std::string beside;    ///< beside the data, "head.nrrd.notes.json"; empty: the scene has no file
  std::string in_cache;  ///< in the user's cache folder, for data sets in folders that the user may not write
};

/// data_file: the data set's path; empty: a scene without a file, whose name is `scene`. cache_folder: the user's.
Shelf shelf_of(const std::string& data_file, const std::string& scene, const std::string& cache_folder);

/// $XDG_CACHE_HOME/telesplat, else ~/.cache/telesplat; empty: neither is known.
std::string user_cache_folder();

/// Reads the file beside the data, or the one in the cache if there is only that; the book is empty if there is
/// neither. If there are both, the one in the cache counts: it was begun when the other one could not be written. path:
/// gets the file that was read. Error: names the file, and what is wrong with it.
Result<Book> read_book(const Shelf& shelf, std::string* path = nullptr);

/// Reads the book, changes it, and writes it: to a new file that takes the old one's place when it is whole. It goes
/// beside the data if that can be written, else to the cache: then `change` may be called a second time. A link stays,
/// and the file behind it is replaced. Group and mode stay, and so does the owner if it is the caller, or the caller is
/// root; a file that would change its owner or group counts as one that cannot be written. Access lists are not kept.
/// Other calls wait meanwhile. Error: a book that cannot be read is left as it is; what `change` says; nowhere to
/// write. path: gets the file that was written.
Status change_book(const Shelf& shelf, const std::function<Status(Book&)>& change, std::string* path = nullptr);

}  // namespace telesplat::notes
