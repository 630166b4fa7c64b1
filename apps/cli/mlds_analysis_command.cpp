// vitrine mlds fit | report | predict
#include "base/error.h"
#include "base/file.h"
#include "command.h"
#include "mlds_options.h"
#include "pipeline/mlds_report.h"
#include "pipeline/mlds_stimuli.h"

namespace vitrine::cli {
namespace fs = std::filesystem;
namespace {

std::string fit_summary(const StudyAnalysis& study) {
    std::string text;
    const auto line = [&](const ScaleAnalysis& a) {
        text += fmt::format("{:<16} {:5d} trials  ", a.name, a.scale.trial_count);
        if (a.scale.outcome == FitOutcome::NotIdentifiable) {
            text += a.scale.reason + "\n";
            return;
        }
        text += fmt::format(
            "lambda {:.4g} [{:.4g}, {:.4g}]  sigma {:.4f}  logLik {:.4f}  AIC {:.2f}  {}\n",
            a.lambda.value, a.lambda_ci95.low, a.lambda_ci95.high, a.scale.sigma,
            a.scale.log_likelihood, a.scale.aic, outcome_name(a.scale.outcome));
        if (!a.scale.reason.empty()) text += "    " + a.scale.reason + "\n";
        for (const std::string& w : a.scale.warnings) text += "    note: " + w + "\n";
    };
    line(study.pooled);
    for (const ScaleAnalysis& o : study.observers) line(o);
    return text;
}

void add_fit(CLI::App& mlds) {
    CLI::App* command = mlds.add_subcommand("fit", "Scales, lambda and diagnostics from answers");
    struct Options : StudyOptions {
        std::vector<std::string> trials;
        std::string stimuli, out, lapse_text = "0";
    };
    auto o = std::make_shared<Options>();
    command
        ->add_option("trials", o->trials,
                     "Trials CSV (resp,S1..S4) or trial logs; several files are several observers")
        ->required()
        ->check(CLI::ExistingFile)
        ->group("Input");
    command->add_option("--stimuli", o->stimuli, "stimuli.json with the refractive indices")
        ->check(CLI::ExistingFile)
        ->group("Input");
    command->add_option("--out", o->out, "scale.json to write")->group("Output");
    command->add_option("--bootstrap", o->bootstrap.replicates, "Replicates for the pooled answers")
        ->capture_default_str()
        ->check(CLI::Range(100, 1'000'000))
        ->group("Quality");
    command
        ->add_option("--bootstrap-observer", o->observer_replicates,
                     "Replicates for each observer of several")
        ->capture_default_str()
        ->check(CLI::Range(100, 1'000'000))
        ->group("Quality");
    command->add_option("--simulations", o->diagnostic_simulations, "Simulations of the tests")
        ->capture_default_str()
        ->check(CLI::Range(20, 1'000'000))
        ->group("Quality");
    command
        ->add_option("--lapse", o->lapse_text,
                     "Share of random answers: a number, or `estimate` to fit it")
        ->capture_default_str()
        ->group("Model");
    command->add_flag("--reversed", o->is_reversed, "The more alike pair was asked for")
        ->group("Model");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        o->estimate_lapse = o->lapse_text == "estimate";
        if (!o->estimate_lapse && (!CLI::detail::lexical_cast(o->lapse_text, o->lapse) ||
                                   !(o->lapse >= 0 && o->lapse < 0.5))) {
            throw UsageError("--lapse: `estimate` or a number from 0 to 0.5");
        }
        o->bootstrap.seed = common->seed;
        std::vector<Observations> all;
        for (const std::string& path : o->trials) {
            for (Observations& observer :
                 parse_trials_csv(read_text_file(path), fs::path(path).stem().string())) {
                all.push_back(std::move(observer));
            }
        }
        const StudyAnalysis study = analyse_study(
            all, o->stimuli.empty() ? std::vector<double>{} : read_stimulus_series(o->stimuli).ior,
            *o, make_progress(*common, "fit"));
        const std::string text = study_to_json(study);
        if (!o->out.empty()) write_text_file(o->out, text);
        fmt::print("{}", common->json ? text : fit_summary(study));
        return study.pooled.scale.is_usable() ? kDone : kUncertain;
    });
}

void add_predict(CLI::App& mlds) {
    CLI::App* command = mlds.add_subcommand(
        "predict", "Guess lambda from the pictures alone: computed, not measured with people");
    struct Options : ComputationalObserverOptions {
        std::string stimuli, out;
    };
    auto o = std::make_shared<Options>();
    command->add_option("stimuli", o->stimuli, "stimuli.json with its linear pictures")
        ->required()
        ->check(CLI::ExistingFile)
        ->group("Input");
    command->add_option("--out", o->out, "prediction.json; stdout when left out")->group("Output");
    command->add_option("--blur-px", o->blur_sigma_px, "The eye's blur, sigma in pixels")
        ->capture_default_str()
        ->group("Model");
    command->add_option("--quantile", o->quantile, "Of |Delta L*| over the pixels")
        ->capture_default_str()
        ->check(CLI::Range(0.5, 1.0))
        ->group("Model");
    command->add_option("--delta-l", o->delta_l, "Visible difference of L*")
        ->capture_default_str()
        ->check(CLI::PositiveNumber)
        ->group("Model");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        const StimulusSeries series = read_stimulus_series(o->stimuli);
        const auto pictures = read_linear_stimuli(fs::path(o->stimuli).parent_path(), series);
        const PredictedThreshold prediction = predict_thresholds(pictures, series.ior, *o);
        write_mlds_text(o->out, prediction_to_json(prediction, *o));
        return std::isfinite(prediction.value) ? kDone : kUncertain;
    });
}

void add_report(CLI::App& mlds) {
    CLI::App* command = mlds.add_subcommand("report", "HTML page about a fitted study");
    struct Options {
        std::string scale, out, prediction, title = "Difference scaling";
    };
    auto o = std::make_shared<Options>();
    command->add_option("scale", o->scale, "scale.json written by `mlds fit`")
        ->required()
        ->check(CLI::ExistingFile)
        ->group("Input");
    command->add_option("--prediction", o->prediction, "prediction.json to draw beside it")
        ->check(CLI::ExistingFile)
        ->group("Input");
    command->add_option("--title", o->title, "Title of the page")
        ->capture_default_str()
        ->group("Output");
    command->add_option("--out", o->out, "HTML file")->required()->group("Output");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        MldsReport report;
        report.title = o->title;
        report.study = study_from_json(read_text_file(o->scale), o->scale);
        if (!o->prediction.empty()) {
            report.prediction = prediction_from_json(read_text_file(o->prediction), o->prediction);
        }
        write_text_file(o->out, mlds_report_html(report));
        return kDone;
    });
}

}  // namespace

void add_mlds_analysis(CLI::App& mlds) {
    add_fit(mlds);
    add_report(mlds);
    add_predict(mlds);
}

}  // namespace vitrine::cli
