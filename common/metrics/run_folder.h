// The folder of a run's record: its files, its id, and how a record begins, is given up and found again.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::metrics {

/// The start of each master that wrote the record (services/master/record/lives.h).
inline constexpr const char* kLivesFile = "lives.csv";

/// Owner of the logs: a launcher writes them; a master that is started by hand finds foreign ones.
enum class Logs { kOurs, kOthers };

/// Lists the files of a record in `directory`, relative to it, sorted: files with names that runs and `telesplat
/// compare` write. Leaves out other files, records of other runs and run.id, and follows no symbolic link.
std::vector<std::string> recorded_files(const std::string& directory, Logs logs = Logs::kOurs);

/// Error: the folder has files, but no run: a record would be scattered among a person's files. kOthers: allows logs
/// that a person who starts a session by hand may have put there.
Status refuse_strangers(const std::string& directory, Logs logs);
/// Makes `directory` the folder of a new record: creates it if needed, and writes run.id into it. Returns the new id.
/// Error, naming the folder: it cannot be written to; it has other files and no run; it has a record already and
/// overwrite is not set; it is to be overwritten, but is no record; a name of ours is a symbolic link. With overwrite,
/// moves the files of the old record, and no others, to ".replaced" in the folder, since the new record may fail.
/// Removes folders of ours that become empty.
Result<std::string> begin_folder(const std::string& directory, bool overwrite, Logs logs);
/// True if a restarted master may continue the record in the folder (RecordOptions::goes_on): the master that began it
/// wrote kLivesFile.
bool may_go_on(const std::string& directory);
/// Continues the record. Returns its id, which it keeps, since viewers that record into the folder know it. Error: a
/// name of ours is a symbolic link.
Result<std::string> go_on_in_folder(const std::string& directory);
/// Error: a name of ours is a symbolic link, which writing would follow.
Status refuse_links(const std::string& directory, Logs logs);
/// The id in the folder's run.id; empty: no id.
std::string folder_id(const std::string& directory);

/// Deletes the files that begin_folder() set aside. To be called when the new record has content.
void forget_replaced(const std::string& directory);

/// Removes a record that is not to be kept: all files since begin_folder(). Restores the record that it was to replace.
/// folder_too: also the folder itself, if it is empty then.
void remove_record(const std::string& directory, bool folder_too);

/// If the folder lies in one that is called "runs": makes "latest" there a symbolic link to it, in one step. Keeps
/// anything else of that name.
void point_latest(const std::string& directory);

}  // namespace telesplat::metrics
