// The folder of a run's record: what is ours in it, whose it is, and how it is begun, given up and found again.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::metrics {

/// Tells when each master that wrote the record began (services/master/record/lives.h).
inline constexpr const char* kLivesFile = "lives.csv";

/// Who looks: a launcher writes logs too; a master that is started by hand finds those of others there.
enum class Logs { kOurs, kOthers };

/// The files of a record that lie in `directory`, relative to it, sorted: those that runs and `telesplat compare`
/// write, by their names. Whatever else lies there is not among them, nor are records of other runs, and no symbolic
/// link is followed. run.id is left out.
std::vector<std::string> recorded_files(const std::string& directory, Logs logs = Logs::kOurs);

/// Error: the folder holds something, and no run: a record would be scattered in a person's files. Whoever starts a
/// session by hand may have put its logs there.
Status refuse_strangers(const std::string& directory, Logs logs);
/// Makes `directory` the folder of a new record: makes it if need be, and writes run.id into it. Returns the new id.
/// Error, naming the folder: it cannot be written to; it holds other things and no run; it holds a record already and
/// overwrite is not set; it is to be overwritten, but is no record; a name of ours is a symbolic link. With overwrite
/// the files of the record before, and nothing else, are set aside in ".replaced" in the folder: the new record may
/// come to nothing. Folders of ours that are empty then are removed.
Result<std::string> begin_folder(const std::string& directory, bool overwrite, Logs logs);
/// Whether a master that is started again may go on with the record in the folder (RecordOptions::goes_on): it was
/// begun by one that told its lives.
bool may_go_on(const std::string& directory);
/// Goes on with it. Returns its id, which it keeps: viewers that record into the folder know it. Error: a name of ours
/// is a symbolic link.
Result<std::string> go_on_in_folder(const std::string& directory);
/// Error: a name of ours is a symbolic link, through which would be written.
Status refuse_links(const std::string& directory, Logs logs);
/// The id in the folder's run.id; empty: there is none.
std::string folder_id(const std::string& directory);

/// Removes for good what begin_folder() set aside: the new record has something to show.
void forget_replaced(const std::string& directory);

/// Removes what begin_folder() and the run after it left: a record that shall not be. The record that it was to replace
/// is put back. folder_too: the folder itself, if it is empty then.
void remove_record(const std::string& directory, bool folder_too);

/// If the folder lies in one that is called "runs": makes "latest" there a symbolic link to it, in one step. Something
/// else of that name stays.
void point_latest(const std::string& directory);

}  // namespace telesplat::metrics
