#include "study_server.h"

#include "base/error.h"

#include <gtest/gtest.h>
#include <httplib.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

namespace vitrine::web {
namespace {
namespace fs = std::filesystem;

class Server : public testing::Test {
  protected:
    void SetUp() override {
        folder = fs::temp_directory_path() /
                 (std::string("vitrine_server_") +
                  testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::remove_all(folder);
        StudyPage page;
        page.title = "Test";
        page.pictures.assign(5, std::string("\x89PNG") + std::string(100'000, 'p'));
        server = std::make_unique<StudyServer>(page, folder, DesignOptions{5, 0, 1, 0, 0, 1}, 0);
        const std::string url = server->url();
        token = url.substr(url.find('#') + 1);
        host = url.substr(7, url.find("/#") - 7);
        port = std::stoi(host.substr(host.find(':') + 1));
        thread = std::thread([this] { server->serve([this] { return stop.load(); }); });
    }
    void TearDown() override {
        stop = true;
        thread.join();
        server.reset();
        fs::remove_all(folder);
    }
    /// Status of a GET with these headers (and the token unless told otherwise); 0: no reply.
    int get(const std::string& path, httplib::Headers headers = {}, bool with_token = true) {
        httplib::Client client("127.0.0.1", port);
        if (with_token) headers.emplace("X-Vitrine-Token", token);
        const auto result = client.Get(path, headers);
        return result ? result->status : 0;
    }
    int post(const std::string& path, const std::string& body,
             const std::string& type = "application/json", httplib::Headers headers = {}) {
        httplib::Client client("127.0.0.1", port);
        headers.emplace("X-Vitrine-Token", token);
        const auto result = client.Post(path, headers, body, type);
        return result ? result->status : 0;
    }

    fs::path folder;
    std::unique_ptr<StudyServer> server;
    std::thread thread;
    std::atomic<bool> stop = false;
    std::string token, host;
    int port = 0;
};

TEST_F(Server, ShowsItsPageWithAStrictPolicy) {
    httplib::Client client("127.0.0.1", port);
    const auto result = client.Get("/");
    ASSERT_TRUE(result);
    EXPECT_EQ(result->status, 200);
    const std::string policy = result->get_header_value("Content-Security-Policy");
    EXPECT_EQ(policy.rfind("default-src 'self'", 0), 0u);
    EXPECT_FALSE(result->has_header("Access-Control-Allow-Origin"));
    EXPECT_EQ(result->get_header_value("X-Content-Type-Options"), "nosniff");
    EXPECT_EQ(result->body.find(token), std::string::npos);
    EXPECT_EQ(get("/study.js"), 200);
    EXPECT_EQ(get("/study.css"), 200);
}

TEST_F(Server, WantsTheToken) {
    EXPECT_EQ(get("/api/study"), 200);
    EXPECT_EQ(get("/api/study", {}, false), 401);
    EXPECT_EQ(get("/api/study", {{"X-Vitrine-Token", std::string(48, '0')}}, false), 401);
    EXPECT_EQ(get("/api/stimulus/1", {}, false), 401);
    EXPECT_EQ(token.size(), 48u);
}

TEST_F(Server, ChecksHostAndOrigin) {
    EXPECT_EQ(get("/api/study", {{"Host", host}}), 200);
    EXPECT_EQ(get("/api/study", {{"Host", "evil.example:" + std::to_string(port)}}), 421);
    EXPECT_EQ(get("/", {{"Host", "evil.example"}}), 421);
    EXPECT_EQ(get("/api/study", {{"Host", host}, {"Origin", "http://" + host}}), 200);
    EXPECT_EQ(get("/api/study", {{"Host", host}, {"Origin", "http://evil.example"}}), 403);
    EXPECT_EQ(get("/api/study", {{"Host", host}, {"Origin", "null"}}), 403);
    EXPECT_EQ(get("/api/study", {{"Sec-Fetch-Site", "cross-site"}}), 403);
}

TEST_F(Server, RefusesRangesWithAnEmptyReply) {
    std::string ranges = "bytes=0-";
    for (int i = 0; i < 1000; ++i) ranges += ",0-";
    httplib::Client client("127.0.0.1", port);
    const auto result =
        client.Get("/api/stimulus/1", {{"Range", ranges}, {"X-Vitrine-Token", token}});
    ASSERT_TRUE(result);
    EXPECT_EQ(result->status, 416);
    EXPECT_TRUE(result->body.empty());
    EXPECT_EQ(get("/", {{"Range", "bytes=0-10"}}), 416);
}

TEST_F(Server, RefusesChunkedAndLargeBodies) {
    httplib::Client client("127.0.0.1", port);
    const auto chunked = client.Post(
        "/api/session", {{"X-Vitrine-Token", token}},
        [](std::size_t offset, httplib::DataSink& sink) {
            if (offset == 0) {
                sink.write("{}", 2);
            } else {
                sink.done();
            }
            return true;
        },
        "application/json");
    if (chunked) {
        EXPECT_EQ(chunked->status, 411);
    }
    const int large = post("/api/session", std::string(1 << 20, ' '));
    EXPECT_TRUE(large == 413 || large == 0) << large;
}

TEST_F(Server, TakesOnlyJsonAndKnownKeys) {
    EXPECT_EQ(post("/api/session", R"({"participant": "ann"})"), 200);
    EXPECT_EQ(post("/api/session", R"({"participant": "ann"})", "text/plain"), 415);
    EXPECT_EQ(post("/api/session", R"({"participant": "../x"})"), 400);
    EXPECT_EQ(post("/api/session", R"({"participant": "ann", "x": 1})"), 400);
    EXPECT_EQ(post("/api/session", "{"), 400);
    EXPECT_EQ(post("/api/session", ""), 400);
    EXPECT_EQ(post("/", "{}"), 405);
    EXPECT_EQ(post("/api/calibration", R"({"participant": "ann", "px_per_mm": 0,
                   "distance_mm": 550, "device_pixel_ratio": 1})"),
              400);
    EXPECT_FALSE(fs::exists(folder.parent_path() / "x"));
}

TEST_F(Server, HasNoOtherFiles) {
    for (const char* path :
         {"/study.html", "/../etc/passwd", "/..%2f..%2fetc/passwd", "/api/stimulus/0",
          "/api/stimulus/6", "/api/stimulus/999", "/participants/ann/log.csv", "/.lock"}) {
        const int status = get(path);
        EXPECT_TRUE(status == 404 || status == 400) << path << " " << status;
    }
    EXPECT_EQ(get("/api/stimulus/5"), 200);
}

TEST_F(Server, ListensOnTheLoopbackOnly) {
    EXPECT_EQ(host.rfind("127.0.0.1:", 0), 0u);
    // Another address of the loopback network reaches a socket bound to all addresses, not ours.
    httplib::Client other("127.0.0.2", port);
    other.set_connection_timeout(1);
    EXPECT_FALSE(other.Get("/"));
}

TEST_F(Server, AnAnswerLeadsToTheNextQuestion) {
    EXPECT_EQ(post("/api/session", R"({"participant": "bo"})"), 200);
    EXPECT_EQ(post("/api/answer", R"({"participant": "bo", "trial": 0, "choice": "top",
                   "key": "ArrowUp", "reaction_ms": 712.4, "stimulus_size_px": 300})"),
              200);
    EXPECT_EQ(post("/api/answer", R"({"participant": "bo", "trial": 1, "choice": "left",
                   "key": "ArrowUp", "reaction_ms": 712.4, "stimulus_size_px": 300})"),
              400);
    EXPECT_TRUE(fs::exists(folder / "participants/bo/trials.csv"));
}

TEST(Pictures, AreReadOnceAndNeverThroughLinks) {
    const fs::path folder = fs::temp_directory_path() / "vitrine_pictures";
    fs::remove_all(folder);
    fs::create_directories(folder);
    std::ofstream(folder / "a.png") << "\x89PNG....";
    fs::create_symlink(folder / "a.png", folder / "b.png");
    EXPECT_EQ(read_pictures(folder, {"a.png"}).size(), 1u);
    EXPECT_THROW(read_pictures(folder, {"b.png"}), InputError);
    EXPECT_THROW(read_pictures(folder, {"../vitrine_pictures/a.png"}), InputError);
    EXPECT_THROW(read_pictures(folder, {"c.png"}), InputError);
    fs::remove_all(folder);
}

}  // namespace
}  // namespace vitrine::web
