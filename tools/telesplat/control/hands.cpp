#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cstdio>
#include <ctime>
#include <filesystem>

#include "client/notes/shelf.h"
#include "common/core/utf8.h"
#include "common/core/whole_file.h"
#include "common/options/complain.h"
#include "common/scene/settings.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/control/json_fields.h"
#include "tools/telesplat/control/orders.h"
#include "tools/telesplat/control/pick.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

struct PickOptions {
  SessionChoice session;
  PickQuestion question;
  std::optional<double> opacity;
  bool json = false;
};

options::Row viewer_row(std::string& viewer) {
  return {.flag = "--viewer", .value = &viewer, .help = "name of the viewer; default: the first one"};
}
options::Row json_row(bool& json) {
  return {.flag = "--json", .value = &json, .help = "print everything for programs"};
}

options::Table pick_table(PickOptions& o) {
  return joined(
      {{.flag = "places",
        .value = &o.question.places,
        .help = "one to three places X,Y of the display, in pixels from the upper left corner or in per cent, "
                "such as 640,400 or 50%,50%: of two the distance is told, of three the angle at the second",
        .required = true},
       {.flag = "--opacity",
        .value = &o.opacity,
        .help = "of volumes: how much must be hidden by what lies in front of the place and at it",
        .limits = options::Range{0.001, 1},
        .default_text = "0.25"},
       viewer_row(o.question.viewer),
       json_row(o.json)},
      session_rows(o.session));
}

int pick(PickOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code);
  if (!client) return exit_code;
  if (o.opacity) o.question.opacity = fmt::format("{}", *o.opacity);
  const auto answer = ask_pick(*client, o.question);
  if (!answer) return complain(answer.error(), client->unanswered() ? 1 : 2);
  if (o.json)
    std::printf("%s\n", answer->dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  else
    std::fputs(pick_text(*answer).c_str(), stdout);
  return 0;
}

// ---- measurements in a window -------------------------------------------------------------------------------------

struct MeasureOptions {
  SessionChoice session;
  std::vector<std::string> words;
  std::string viewer;
  std::optional<double> opacity;
  bool json = false;
};

options::Table measure_table(MeasureOptions& o) {
  return joined({{.flag = "words",
                  .value = &o.words,
                  .help = "list; add X,Y [X,Y [X,Y]]: a row of places, as ctl pick takes them; remove NUMBER; clear; "
                          "save FILE.csv"},
                 {.flag = "--opacity",
                  .value = &o.opacity,
                  .help = "of add and of volumes: as ctl pick has it",
                  .limits = options::Range{0.001, 1},
                  .default_text = "0.25"},
                 viewer_row(o.viewer),
                 json_row(o.json)},
                session_rows(o.session));
}

int measure(MeasureOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  const std::string what = o.words.empty() ? "list" : o.words.front();
  const std::vector<std::string> more(o.words.begin() + std::min<ptrdiff_t>(1, ptrdiff_t(o.words.size())),
                                      o.words.end());
  const bool alone = what == "list" || what == "clear", one = what == "remove" || what == "save";
  if (!(alone && more.empty()) && !(one && more.size() == 1) && !(what == "add" && !more.empty()))
    return complain({"ctl measure: needs list, add X,Y ..., remove NUMBER, clear or save FILE.csv"});
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code);
  if (!client) return exit_code;
  std::map<std::string, std::string> arguments{{"do", what == "save" ? "csv" : what}};
  if (what == "add") arguments["at"] = fmt::format("{}", fmt::join(more, " "));
  if (what == "remove") arguments["number"] = more.front();
  if (o.opacity) arguments["opacity"] = fmt::format("{}", *o.opacity);
  if (!o.viewer.empty()) arguments["viewer"] = o.viewer;
  const auto answer = client->ask("measure", kPatience_s, arguments);
  if (!answer) return complain(answer.error(), client->unanswered() ? 1 : 2);
  const Json json = Json::parse(*answer, nullptr, false);
  if (what == "save") {
    if (const Status s = write_whole(more.front(), text(json, "csv")); !s) return complain(s.error());
    std::printf("%s\n", more.front().c_str());
  } else if (o.json) {
    std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  } else {
    std::fputs(measurements_text(json).c_str(), stdout);
  }
  return 0;
}

// ---- notes and bookmarks of a data set ----------------------------------------------------------------------------

struct KeptOptions {
  SessionChoice session;
  std::vector<std::string> words;
  std::string viewer, data, at;
  bool json = false;
};

options::Table kept_table(KeptOptions& o, const std::string& words) {
  return joined({{.flag = "words", .value = &o.words, .help = words},
                 {.flag = "--data",
                  .value = &o.data,
                  .help = "the data set's file, where no session shows it; default: the session's"},
                 viewer_row(o.viewer),
                 json_row(o.json)},
                session_rows(o.session));
}

options::Table bookmark_table(KeptOptions& o) {
  return kept_table(o, "list; add NAME: keeps the viewer's view; go NAME: leads a window there; remove NAME");
}

options::Table notes_table(KeptOptions& o) {
  return joined(kept_table(o, "list; add TEXT; remove NUMBER"),
                {{.flag = "--at",
                  .value = &o.at,
                  .help = "of add: the place that the note is about, X,Y of the display as ctl pick takes it"}});
}

std::string now_text() { return fmt::format("{:%FT%TZ}", fmt::gmtime(std::time(nullptr))); }

// The session that a command is about, if the command needs one.
class Subject {
 public:
  Subject(KeptOptions& o, const options::Given& given) : o_(o), given_(given) {}

  /// Returns the shelf of the session's file, or of --data. Error, exit code: no session, no file.
  Result<notes::Shelf> shelf(int& exit_code) {
    exit_code = 2;
    std::string file = o_.data, scene;
    if (file.empty()) {
      if (!client(exit_code)) return Error{};
      const auto status = client_->status(kPatience_s);
      if (!status) {
        exit_code = 1;
        return status.error();
      }
      for (const Json& p : array(*status, "processes"))
        if (const auto* facts = field(p, "facts"); text(p, "role") == "data" && facts) {
          file = text(*facts, "data_file");
          scene = text(*facts, "scene");
        }
      if (file.empty() && scene.empty()) return Error{"the session shows nothing yet, so there is nothing to keep"};
    } else {
      std::error_code error;
      if (!std::filesystem::exists(file, error)) return Error{file + ": there is no such file"};
      file = std::filesystem::absolute(file, error).lexically_normal().string();
    }
    return notes::shelf_of(file, scene, notes::user_cache_folder());
  }
  ControlClient* client(int& exit_code) {
    if (!client_) client_ = reach(o_.session, given_, exit_code);
    return client_.get();
  }
  std::map<std::string, std::string> viewer() const {
    if (o_.viewer.empty()) return {};
    return {{"viewer", o_.viewer}};
  }

 private:
  KeptOptions& o_;
  const options::Given& given_;
  std::unique_ptr<ControlClient> client_;
};

// Joins the words after the first.
std::string rest(const std::vector<std::string>& words) {
  return fmt::format("{}",
                     fmt::join(words.begin() + std::min<ptrdiff_t>(1, ptrdiff_t(words.size())), words.end(), " "));
}

int said(const Error& error, int exit_code) { return error.text.empty() ? exit_code : complain(error, exit_code); }

int print_book(const notes::Shelf& shelf, bool json, bool bookmarks) {
  std::string path;
  const auto book = notes::read_book(shelf, &path);
  if (!book) return complain(book.error());
  if (json) {
    Json out = Json::parse(notes::to_json(*book));
    out["file"] = path;
    std::printf("%s\n", out.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
    return 0;
  }
  if (bookmarks)
    for (const auto& b : book->bookmarks)
      std::printf("%s%s%s\n", printable(b.name).c_str(), b.made_at.empty() ? "" : "  ", printable(b.made_at).c_str());
  else
    for (const auto& n : book->notes) {
      std::printf("%llu  %s\n", static_cast<unsigned long long>(n.number), printable_lines(n.text).c_str());
      if (n.place)
        std::printf("   at %.10g, %.10g, %.10g%s%s\n", n.place->x, n.place->y, n.place->z, n.value.empty() ? "" : "; ",
                    printable(n.value).c_str());
    }
  if (bookmarks ? book->bookmarks.empty() : book->notes.empty())
    std::printf("there are no %s; ctl %s add makes one\n", bookmarks ? "bookmarks" : "notes",
                bookmarks ? "bookmark" : "notes");
  return 0;
}

// Changes the book and prints its path. A refused change is the user's mistake: exit code 2.
int change(const notes::Shelf& shelf, const std::string& done, const std::function<Status(notes::Book&)>& how) {
  std::string path;
  if (const Status s = notes::change_book(shelf, how, &path); !s) return complain(s.error());
  std::printf("%s in %s\n", done.c_str(), path.c_str());
  return 0;
}

Result<notes::Bookmark> view_of(ControlClient& client, const std::map<std::string, std::string>& viewer) {
  const auto answer = client.ask("where", kPatience_s, viewer);
  if (!answer) return answer.error();
  const Json json = Json::parse(*answer, nullptr, false);
  const auto p = numbers(json, "position", 3), q = numbers(json, "orientation", 4);
  if (!p || !q) return Error{"the viewer's answer is no view"};
  notes::Bookmark out;
  out.pose = {{(*p)[0], (*p)[1], (*p)[2]}, {(*q)[0], (*q)[1], (*q)[2], (*q)[3]}};
  out.made_at = now_text();
  return out;
}

int go(Subject& subject, const notes::Shelf& shelf, const std::string& name) {
  const auto book = notes::read_book(shelf);
  if (!book) return complain(book.error());
  const notes::Bookmark* bookmark = book->find(name);
  if (!bookmark) return complain({fmt::format("there is no bookmark \"{}\"", name.substr(0, notes::kMaxName))});
  int exit_code = 0;
  ControlClient* client = subject.client(exit_code);
  if (!client) return exit_code;
  auto arguments = subject.viewer();
  const auto& [p, q] = bookmark->pose;
  arguments["pose"] = fmt::format("{},{},{},{},{},{},{}", p.x, p.y, p.z, q.w, q.x, q.y, q.z);
  return tell_answer(client->order("go", kPatience_s, arguments), "at " + name);
}

int bookmark(KeptOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  const std::string what = o.words.empty() ? "list" : o.words.front(), name = rest(o.words);
  const bool named = what == "add" || what == "go" || what == "remove";
  if ((!named && what != "list") || named == name.empty())
    return complain({"ctl bookmark: needs list, add NAME, go NAME or remove NAME"});
  Subject subject(o, given);
  int exit_code = 0;
  const auto shelf = subject.shelf(exit_code);
  if (!shelf) return said(shelf.error(), exit_code);
  if (what == "list") return print_book(*shelf, o.json, true);
  if (what == "go") return go(subject, *shelf, name);
  if (what == "remove") return change(*shelf, "removed", [&](notes::Book& book) { return book.remove_bookmark(name); });
  ControlClient* client = subject.client(exit_code);
  if (!client) return exit_code;
  auto view = view_of(*client, subject.viewer());
  if (!view) return complain(view.error(), client->unanswered() ? 1 : 2);
  view->name = name;
  return change(*shelf, "kept", [&](notes::Book& book) { return book.keep(*view); });
}

// Finds the place of a note. Error: nothing is there.
Status find_place(ControlClient& client, const KeptOptions& o, notes::Note& note) {
  const auto answer = ask_pick(client, {.places = {o.at}, .viewer = o.viewer, .opacity = {}});
  if (!answer) return answer.error();
  const Json picks = array(*answer, "picks"), pick = picks.empty() ? Json() : picks.front();
  const auto data = numbers(pick, "data", 3);
  if (!data) return Error{fmt::format("nothing lies at {}", o.at.substr(0, 40))};
  note.place = {(*data)[0], (*data)[1], (*data)[2]};
  note.value = value_text(pick);
  return ok_status();
}

int keep_notes(KeptOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  const std::string what = o.words.empty() ? "list" : o.words.front(), text = rest(o.words);
  if ((what != "list" && what != "add" && what != "remove") || (what == "list") != text.empty())
    return complain({"ctl notes: needs list, add TEXT or remove NUMBER"});
  Subject subject(o, given);
  int exit_code = 0;
  const auto shelf = subject.shelf(exit_code);
  if (!shelf) return said(shelf.error(), exit_code);
  if (what == "list") return print_book(*shelf, o.json, false);
  if (what == "remove") {
    uint64_t number = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
    if (read.ec != std::errc() || read.ptr != text.data() + text.size())
      return complain({fmt::format("ctl notes remove: \"{}\" is no note's number", text.substr(0, 40))});
    return change(*shelf, "removed", [&](notes::Book& book) { return book.remove_note(number); });
  }
  notes::Note note{.text = text, .made_at = now_text()};
  if (!o.at.empty()) {
    ControlClient* client = subject.client(exit_code);
    if (!client) return exit_code;
    if (const Status s = find_place(*client, o, note); !s) return complain(s.error(), client->unanswered() ? 1 : 2);
  }
  return change(*shelf, "kept", [&](notes::Book& book) -> Status {
    const auto number = book.add(note);
    return number ? ok_status() : Status(number.error());
  });
}

}  // namespace

std::vector<Command> hands_commands() {
  return {
      make_command("pick", "what lies at places of a viewer's display, in the data's own coordinates", pick_table,
                   pick),
      make_command("measure", "places that a window has marked, their distances and angles", measure_table, measure),
      make_command("bookmark", scene::help_of_order("bookmark"), bookmark_table, bookmark),
      make_command("notes", scene::help_of_order("notes"), notes_table, keep_notes)};
}

}  // namespace telesplat::launcher
