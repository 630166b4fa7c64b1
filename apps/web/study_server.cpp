#include "study_server.h"

#include "base/error.h"
#include "base/json_reader.h"
#include "base/log.h"
#include "page_assets.h"
#include "study_store.h"

#include <httplib.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <thread>

namespace vitrine::web {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxBody = 16 * 1024;
constexpr off_t kMaxPicture = 64 << 20;

std::string random_token() {
    unsigned char bytes[24];
    if (::getrandom(bytes, sizeof bytes, 0) != static_cast<ssize_t>(sizeof bytes)) {
        throw MachineError("the system gives no random numbers");
    }
    std::string token;
    for (const unsigned char b : bytes) token += fmt::format("{:02x}", b);
    return token;
}

/// Takes as long for a wrong token as for the right one.
bool is_same(const std::string& a, const std::string& b) {
    if (a.size() != b.size()) return false;
    unsigned difference = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        difference |= static_cast<unsigned>(a[i] ^ b[i]);
    }
    return difference == 0;
}

/// Only address reuse: the library's default would let another program share the port.
void set_socket_options(int socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

Json state_json(const SessionState& state) {
    Json json;
    json["participant"] = state.participant;
    json["next"] = state.next;
    json["total"] = state.total;
    json["has_consented"] = state.has_consented;
    json["is_done"] = state.is_done();
    json["calibration"] = {{"px_per_mm", state.calibration.px_per_mm},
                           {"distance_mm", state.calibration.distance_mm},
                           {"device_pixel_ratio", state.calibration.device_pixel_ratio}};
    if (!state.is_done()) {
        // The page learns what to show, not which rank is which pair of the analysis.
        const Quadruple screen = screen_order(state.trial);
        json["trial"] = {{"top", {screen[0], screen[1]}},
                         {"bottom", {screen[2], screen[3]}},
                         {"is_practice", state.trial.kind == TrialKind::Practice}};
    }
    return json;
}

void reply(httplib::Response& response, const Json& json) {
    response.set_content(json.dump(), "application/json");
}

}  // namespace

std::vector<std::string> read_pictures(const fs::path& folder,
                                       const std::vector<std::string>& files) {
    std::vector<std::string> pictures;
    for (const std::string& file : files) {
        const fs::path path = folder / file;
        if (fs::path(file).filename().string() != file || file.empty()) {
            throw InputError({folder.string(), "file names without a folder", file, ""});
        }
        const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
        struct stat about {};
        const bool is_readable = descriptor >= 0 && ::fstat(descriptor, &about) == 0 &&
                                 S_ISREG(about.st_mode) && about.st_size <= kMaxPicture;
        std::string bytes(is_readable ? static_cast<std::size_t>(about.st_size) : 0, '\0');
        std::size_t have = 0;
        while (have < bytes.size()) {
            const ssize_t got = ::read(descriptor, bytes.data() + have, bytes.size() - have);
            if (got <= 0) break;
            have += static_cast<std::size_t>(got);
        }
        if (descriptor >= 0) ::close(descriptor);
        if (have == 0 || have < bytes.size() || bytes.compare(0, 4, "\x89PNG") != 0) {
            throw InputError({path.string(), "a PNG file (no link)",
                              descriptor < 0 ? std::strerror(errno) : "something else", ""});
        }
        pictures.push_back(std::move(bytes));
    }
    return pictures;
}

struct StudyServer::Implementation {
    StudyPage page;
    StudyStore store;
    httplib::Server http;
    std::string token = random_token();
    std::string host, url;

    Implementation(StudyPage p, const fs::path& folder, const DesignOptions& design)
        : page(std::move(p)), store(folder, design) {}

    /// The status to refuse a request with, or 0. Runs before any body is read.
    int refusal(const httplib::Request& request) const {
        // One Range header makes the library build a reply of a gigabyte; a chunked body has no
        // length to judge. The reply is empty, so that a range of it is empty as well.
        if (request.has_header("Range")) return 416;
        if (request.has_header("Transfer-Encoding")) return 411;
        if (request.method != "GET" && request.method != "POST") return 405;
        const std::string asked = request.get_header_value("Host");
        if (request.get_header_value_count("Host") != 1) return 400;
        if (asked != host && asked != "localhost" + host.substr(host.find(':'))) return 421;
        if (request.has_header("Origin") &&
            request.get_header_value("Origin") != "http://" + asked) {
            return 403;
        }
        const std::string site = request.get_header_value("Sec-Fetch-Site");
        if (!site.empty() && site != "same-origin" && site != "none") return 403;
        if (request.path.rfind("/api/", 0) != 0) return request.method == "GET" ? 0 : 405;
        if (!is_same(request.get_header_value("X-Vitrine-Token"), token)) return 401;
        if (request.method == "GET") return 0;
        if (request.get_header_value("Content-Type") != "application/json") return 415;
        if (!request.has_header("Content-Length")) return 411;
        return 0;
    }

    void protect() {
        http.set_socket_options(set_socket_options);
        http.set_payload_max_length(kMaxBody);
        http.set_keep_alive_max_count(1);  // what a refused request left unread dies with it
        http.set_read_timeout(5);
        http.set_write_timeout(10);
        http.set_default_headers(
            {{"Content-Security-Policy",
              "default-src 'self'; img-src 'self' blob:; base-uri 'none'; form-action 'none'; "
              "frame-ancestors 'none'"},
             {"X-Content-Type-Options", "nosniff"},
             {"X-Frame-Options", "DENY"},
             {"Referrer-Policy", "no-referrer"},
             {"Cross-Origin-Resource-Policy", "same-origin"},
             {"Cross-Origin-Opener-Policy", "same-origin"},
             {"Cache-Control", "no-store"}});
        http.set_pre_routing_handler(
            [this](const httplib::Request& request, httplib::Response& response) {
                const int status = refusal(request);
                if (status == 0) return httplib::Server::HandlerResponse::Unhandled;
                response.status = status;
                return httplib::Server::HandlerResponse::Handled;
            });
        http.set_exception_handler(
            [](const httplib::Request&, httplib::Response& response, std::exception_ptr error) {
                try {
                    std::rethrow_exception(error);
                } catch (const InputError& e) {
                    response.status = 400;
                    reply(response, {{"error", e.what()}});
                } catch (const MachineError& e) {
                    log_warning("{}", e.what());
                    response.status = 507;
                    reply(response, {{"error", e.what()}});
                } catch (const std::exception& e) {
                    log_warning("{}", e.what());
                    response.status = 500;
                    reply(response, {{"error", "an error in the server"}});
                }
            });
    }

    void add_page() {
        for (const PageAsset& asset : page_assets()) {
            http.Get(asset.path, [asset](const httplib::Request&, httplib::Response& response) {
                response.set_content(std::string(asset.text), asset.type);
            });
        }
        http.Get("/favicon.ico", [](const httplib::Request&, httplib::Response& response) {
            response.status = 204;
        });
    }

    void add_reads() {
        http.Get("/api/study", [this](const httplib::Request&, httplib::Response& response) {
            reply(response, {{"title", page.title},
                             {"stimulus_count", page.pictures.size()},
                             {"distance_mm", page.distance_mm},
                             {"picture_deg", page.picture_deg},
                             {"break_every", page.break_every}});
        });
        http.Get(R"(/api/stimulus/(\d{1,3}))",
                 [this](const httplib::Request& request, httplib::Response& response) {
                     const auto rank = static_cast<std::size_t>(std::stoi(request.matches[1]));
                     if (rank < 1 || rank > page.pictures.size()) {
                         response.status = 404;
                         return;
                     }
                     response.set_content(page.pictures[rank - 1], "image/png");
                 });
    }

    void add_writes() {
        http.Post("/api/session", [this](const auto& request, auto& response) {
            const JsonObject body = read_json_text(request.body, "request");
            const std::string participant = body.text("participant");
            body.finish();
            reply(response, state_json(store.open(participant)));
        });
        http.Post("/api/consent", [this](const auto& request, auto& response) {
            const JsonObject body = read_json_text(request.body, "request");
            const std::string participant = body.text("participant");
            body.finish();
            reply(response, state_json(store.give_consent(participant)));
        });
        http.Post("/api/calibration", [this](const auto& request, auto& response) {
            const JsonObject body = read_json_text(request.body, "request");
            const std::string participant = body.text("participant");
            const Calibration calibration{body.number("px_per_mm"), body.number("distance_mm"),
                                          body.number("device_pixel_ratio")};
            body.finish();
            reply(response, state_json(store.calibrate(participant, calibration)));
        });
        http.Post("/api/answer", [this](const auto& request, auto& response) {
            const JsonObject body = read_json_text(request.body, "request");
            const std::string participant = body.text("participant");
            Answer answer;
            answer.trial = static_cast<int>(body.integer("trial"));
            answer.chose_top = body.choice("choice", {"top", "bottom"}) == "top";
            answer.key = body.text("key");
            answer.reaction_ms = body.number("reaction_ms");
            answer.stimulus_size_px = body.number("stimulus_size_px");
            body.finish();
            reply(response, state_json(store.answer(participant, answer)));
        });
    }
};

StudyServer::StudyServer(StudyPage page, const fs::path& study_folder, const DesignOptions& design,
                         int port)
    : implementation_(std::make_unique<Implementation>(std::move(page), study_folder, design)) {
    Implementation& i = *implementation_;
    i.protect();
    i.add_page();
    i.add_reads();
    i.add_writes();
    const char* const kLoopback = "127.0.0.1";
    const int bound = port == 0                              ? i.http.bind_to_any_port(kLoopback)
                      : i.http.bind_to_port(kLoopback, port) ? port
                                                             : -1;
    if (bound <= 0) throw MachineError(fmt::format("port {} cannot be used", port));
    i.host = fmt::format("{}:{}", kLoopback, bound);
    i.url = fmt::format("http://{}/#{}", i.host, i.token);
}

StudyServer::~StudyServer() = default;

const std::string& StudyServer::url() const { return implementation_->url; }

void StudyServer::serve(const std::function<bool()>& should_stop) {
    std::atomic<bool> has_ended = false;
    std::thread watch([&] {
        while (!has_ended && !should_stop()) {
            std::this_thread::sleep_for(std::chrono::milliseconds(200));
        }
        implementation_->http.stop();
    });
    implementation_->http.listen_after_bind();
    has_ended = true;
    watch.join();
}

}  // namespace vitrine::web
