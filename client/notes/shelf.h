// Where books of notes lie, and how they are read and written, so that no reader ever sees half of one and no bad file
// is ever overwritten.
#pragma once

#include <functional>
#include <string>

#include "client/notes/book.h"

namespace telesplat::notes {

/// The files of a data set's book.
struct Shelf {
  std::string beside;    ///< beside the data, "head.nrrd.notes.json"; empty: the scene has no file
  std::string in_cache;  ///< in the user's cache folder, for data sets that lie where nobody may write
};

/// data_file: the data set's path; empty: a scene without a file, whose name is `scene`. cache_folder: the user's.
Shelf shelf_of(const std::string& data_file, const std::string& scene, const std::string& cache_folder);

/// $XDG_CACHE_HOME/telesplat, else ~/.cache/telesplat; empty: neither is known.
std::string user_cache_folder();

/// The book: of the file beside the data, or if there is none of the one in the cache; empty if neither is there. If
/// both are, that in the cache counts: it was begun when the other one could not be written. path: which one it was.
/// Error: names the file, and what is wrong with it.
Result<Book> read_book(const Shelf& shelf, std::string* path = nullptr);

/// Reads the book, changes it, and writes it: to a new file that takes the old one's place when it is whole. Beside the
/// data if that can be written, else in the cache: `change` is called again where that turns out late. Of a link the
/// file behind it is replaced. Group and mode stay, and so does the owner if it is the caller, or the caller is root; a
/// file that would be taken from its owner or its group is one that cannot be written. Access lists are not kept.
/// Others who do the same wait meanwhile. Error: a book that cannot be read is left as it is; what `change` says;
/// nowhere to write. path: where it was written.
Status change_book(const Shelf& shelf, const std::function<Status(Book&)>& change, std::string* path = nullptr);

}  // namespace telesplat::notes
