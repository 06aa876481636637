"""The heavy lane: proofs that `make soak` runs in full, and `make changed` if what they prove was changed.

Of each kind of proof one stays in `make test`; the table names what leaves it. A proof that is one test among many of
its file stands here; one that is made smaller beside the heavy lane asks `SOAK` itself.
"""

import os
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
SINCE = os.environ.get("ACCEPT_SINCE")  # a commit: heavy proofs of what was changed since then run too
ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Heavy:
    """Heavy tests of one file. proves: folders of the product, or files; tests: names, with the parameters in brackets
    if only some leave `make test`; stays: what stays of their kind."""

    proves: Sequence[str]
    tests: Sequence[str]
    stays: str


HEAVY: Mapping[str, Heavy] = {
    "tests/checks/gap/test_disagreement.py": Heavy(
        ["checks/gap"],
        [
            "test_a_filter_of_fourth_order_is_no_delay",
            "test_a_mode_of_one_channel_is_no_support",
            "test_a_mode_that_every_channel_sees_in_its_own_part_has_no_name",
            "test_and_is_named_where_the_library_has_it",
            "test_name_value_and_rest",
        ],
        "a payload beside a guide, with its value and the rest, in test_bench_paths.py; a name beside a refused "
        "remainder, in tests/accept/gap/test_gap_every_verdict.py; a resonance that is no effect's, in "
        "test_never_worse.py",
    ),
    "tests/accept/gap/test_gap_every_verdict.py": Heavy(
        ["accept/gap", "checks/gap", "checks/fitting"],
        [
            "test_every_verdict_is_reported_whole[name beside a refused remainder, experiment]",
            "test_every_verdict_is_reported_whole[unexplained, experiment]",
            "test_every_verdict_is_reported_whole[unexplained]",
        ],
        "a refused remainder beside a name, without an experiment, and every other verdict; unexplained as it is "
        "found, in tests/checks/gap/test_never_worse.py, and on the pages, in test_gap_pdf.py",
    ),
    "tests/checks/gap/test_false_names.py": Heavy(
        ["checks/gap"],
        ["test_a_resonance_of_the_encoder_is_no_scale"],
        "a resonance on Vs that gets no name, in test_never_worse.py; the other rules of this file, on candidates",
    ),
    "tests/checks/gap/test_never_worse.py": Heavy(
        ["checks/gap"],
        [
            "test_records_turned_without_need_are_taken_as_they_came",
            "test_a_fault_is_told_and_no_channel_gets_worse[da turned]",
            "test_a_fault_is_told_and_no_channel_gets_worse[de and Vs exchanged]",
            "test_a_fault_is_told_and_no_channel_gets_worse[de dead]",
            "test_a_fault_is_told_and_no_channel_gets_worse[de and da exchanged]",
        ],
        "a channel that is turned, a resonance on Vs in records as they are; each fault by its check, in "
        "tests/checks/acceptance/test_responses.py",
    ),
    "tests/checks/gap/test_conditions.py": Heavy(
        ["checks/gap"],
        [
            "test_the_mass_that_was_asked_for_names_the_payload",
            "test_values_that_explain_all_leave_no_effect",
            "test_another_answer_at_another_level_is_said_without_a_linear_name",
        ],
        "an experiment that is contradicted",
    ),
    "tests/checks/gap/test_acquisition.py": Heavy(
        ["checks/gap"],
        [
            "test_is_named_for_what_it_is[amplifier of second order, 1.8 kHz]",
            "test_is_named_for_what_it_is[filter of second order, 3 kHz, on da]",
            "test_is_named_for_what_it_is[filter of fourth order, 2.5 kHz, on Vs]",
            "test_is_named_for_what_it_is[skew of 20 us on Vs]",
            "test_is_named_for_what_it_is[high-pass of second order, 8 Hz]",
            "test_is_named_for_what_it_is[skew of 20 us on de]",
            "test_a_drift_between_records_is_no_effect",
        ],
        "whole samples; a gain that drifts, in tests/accept/gap/test_twelve_effects.py; a pickup that is no "
        "latency, in test_lags.py",
    ),
    "tests/checks/gap/test_gap.py": Heavy(
        ["checks/gap"],
        [
            "test_recorded_unit[S-02]",
            "test_recorded_unit[S-06]",
            "test_what_only_a_value_far_off_explains_is_said",
            "test_a_latency_is_not_told_from_a_filter_far_above_the_band",
            "test_one_effect[crosstalk-values0]",
            "test_polarity_and_offset_first",
        ],
        "nothing missing; recorded unit S-01; a payload by its name and value in test_gap_robust.py, a high-pass in "
        "tests/accept/gap; a turned sensor and what stays unexplained in test_never_worse.py; whole samples in "
        "test_acquisition.py; a short delay in test_gap_robust.py",
    ),
    "tests/checks/gap/test_gap_contract.py": Heavy(
        ["checks/gap"],
        [
            "test_found_by_name_with_its_values[crosstalk]",
            "test_found_by_name_with_its_values[creep]",
            "test_not_named_where_it_is_not",
        ],
        "nothing missing of a drawn strut and of recorded S-01, in test_gap.py; a payload by its name in "
        "test_gap_robust.py",
    ),
    "tests/checks/gap/test_gap_robust.py": Heavy(
        ["checks/gap"],
        ["test_crosstalk_is_another_sensor_constant", "test_payload_is_a_scaling_of_force_stiffness_and_damping"],
        "a short delay that is an amplifier; what the data tell apart",
    ),
    "tests/checks/gap/test_lags.py": Heavy(
        ["checks/gap"],
        [
            "test_a_hold_of_another_rate_is_no_amplifier",
            "test_what_the_band_shows_is_named[channel_lowpass_de-values1]",
            "test_what_the_band_shows_is_named[loop_delay-values2]",
            "test_what_the_band_shows_is_named[amplifier_second_order-values0]",
            "test_a_lag_whose_form_the_band_does_not_show_is_ambiguous",
            "test_a_learned_latency_imitates_no_delay[False]",
            "test_a_learned_latency_imitates_no_delay[True]",
        ],
        "a pickup that is no latency; a learned bench that has its paths, in test_bench_paths.py; a short delay "
        "whose form the band does not show, in test_gap_robust.py",
    ),
    "tests/checks/gap/test_effects_of_others.py": Heavy(
        ["checks/gap", "specs/plugins.py"],
        [
            "test_within_bounds_it_is_named_and_else_listed[False]",
            "test_within_bounds_it_is_named_and_else_listed[True]",
        ],
        "an installed effect that is named, in tests/plugins; broken ones; its derivatives",
    ),
    "tests/checks/gap/search/test_elements.py": Heavy(
        ["checks/gap"],
        [
            "test_a_holder_beside_the_axis_is_found_with_its_point_and_mass",
            "test_a_resonance_of_one_channel_is_a_filter_of_it_and_no_pair_of_elements",
            "test_known_effects_keep_their_names_and_nothing_is_nothing",
            "test_elements_of_an_independent_simulation[E-01]",
            "test_elements_of_an_independent_simulation[E-03]",
            "test_elements_of_an_independent_simulation[E-04]",
            "test_elements_of_an_independent_simulation[E-05]",
            "test_a_loose_joint_is_one_with_its_end_and_ratio",
            "test_what_swings_on_the_payload_is_a_resonator",
            "test_a_payload_that_rocks_is_no_mass_on_a_spring",
            "test_bellows_that_the_calibration_has_followed_are_found_from_the_priors",
            "test_elements_of_an_independent_simulation[E-02]",
            "test_a_damper_across_the_axis_is_found_though_the_encoder_alone_shows_it",
            "test_a_bump_of_the_drive_of_a_strut_as_built_is_a_filter_of_it",
        ],
        "bellows, which are a spring; kind, place, joint and mass by their stiffness, and a factor of one channel, "
        "in TestPlaces; a spring, a mass and a resonator of linear structures, in test_linear.py; crosstalk without "
        "an element beside it, and recorded S-01 without an effect, in test_gap.py; a resonance on Vs that nothing "
        "explains, in test_never_worse.py",
    ),
    "tests/checks/gap/search/test_parts.py": Heavy(
        ["checks/gap"],
        [
            "test_half_a_dead_stack_is_no_agreement_with_parts_that_were_measured",
            "test_a_mode_that_was_missed_on_the_way_is_put_in_its_place[150]",
        ],
        "a stiff joint among measured joints, sound struts that agree, a missed mode of another strut",
    ),
    "tests/checks/gap/search/test_linear.py": Heavy(
        ["checks/gap"],
        [
            "test_an_element_is_found_by_place_kind_and_value[hidden1-mass-place1-m_kg-0.8]",
            "test_what_is_hidden_on_a_real_background_is_found[3]",
            "test_what_is_hidden_on_a_real_background_is_found[4]",
            "test_what_is_hidden_on_a_real_background_is_found[13]",
            "test_what_is_hidden_on_a_real_background_is_found[28]",
        ],
        "springs and a resonator by place, kind and value, and four of eight on a real background",
    ),
    "tests/accept/units/test_strut_plates.py": Heavy(
        ["accept/gap", "checks/gap", "accept/models"],
        ["test_an_effect_is_found_in_two_channels_and_hysteresis_in_da"],
        "the gap of a sound one, in two channels, with what it cannot see; a delay and a hysteresis by name and value, "
        "in tests/checks/gap, the same words on page and terminal in tests/accept/gap",
    ),
    "tests/accept/fleet/process_control/test_self_starting.py": Heavy(
        ["accept/fleet/process_control"],
        ["test_a_bench_in_control_rings_in_one_chart_of_fifty[52]"],
        "a short chart, which is scanned afterwards too, and a long one, which is not",
    ),
    "tests/checks/gap/search/test_starts.py": Heavy(
        ["checks/gap"],
        ["test_a_misaligned_strut_is_explained_from_far_away[10.0-280.0]"],
        "another place far away",
    ),
    "tests/checks/fitting/test_fit.py": Heavy(
        ["checks/fitting"],
        [
            "test_intervals_hold_for_a_model_that_is_a_little_wrong[octave]",
            "test_intervals_hold_for_a_model_that_is_a_little_wrong[mode]",
            "test_intervals_hold_for_a_model_that_is_a_little_wrong[gain]",
            "test_intervals_without_the_tolerance_would_not_hold",
        ],
        "the model itself, and noise alone",
    ),
    "tests/checks/acceptance/test_stiffness.py": Heavy(
        ["checks/acceptance", "checks/signals"],
        ["test_intervals_are_honest[noisy]", "test_intervals_are_honest[hand]"],
        "the sharp step",
    ),
    "tests/accept/certificate/test_concession.py": Heavy(
        ["accept/certificate", "accept/judging"],
        [
            "test_a_concession_stays_whatever_becomes_of_the_note[countersigned-note kept]",
            "test_a_concession_stays_whatever_becomes_of_the_note[disposed-note kept]",
            "test_rework_releases_once_it_was_measured_again[note kept-rework]",
            "test_rework_releases_once_it_was_measured_again[note deleted-measure-again]",
            "test_a_yield_counts_the_decided_unit_by_its_decision[measure-again-0-0]",
            "test_a_yield_counts_the_decided_unit_by_its_decision[return-0-0]",
            "test_a_yield_counts_the_decided_unit_by_its_decision[scrap-0-0]",
            "test_what_is_returned_or_scrapped_stays_held[scrap]",
        ],
        "both ways to concede with the note deleted; rework and another measurement, with and without the note; what"
        " is returned; use as it is and rework in a yield",
    ),
    "tests/accept/certificate/verify/test_verify_bytes.py": Heavy(
        ["accept/certificate"],
        ["test_every_flipped_bit_is_found[signed]"],
        "the same of the countersigned certificate, which holds the signed one",
    ),
    "tests/accept/gap/test_gap_batch.py": Heavy(
        ["accept/gap", "accept/batch"],
        ["test_another_model_is_another_question", "test_the_unit_is_judged_all_the_same[error1]"],
        "a batch that is stopped and goes on, a search that breaks",
    ),
    "tests/accept/gap/test_faulty_records.py": Heavy(
        ["checks/signals", "accept/gap", "accept/judging"],
        [
            "test_judging_says_the_same[de held]",
            "test_judging_says_the_same[block of all lost]",
            "test_judging_says_the_same[block of de lost]",
            "test_judging_says_the_same[jitter]",
            "test_every_command_refuses_with_the_cause[fit]",
            "test_every_command_refuses_with_the_cause[misalign]",
            "test_the_api_refuses_too[estimate_misalignment]",
            "test_the_api_refuses_too[analyse_gap]",
            "test_judging_says_the_same[de clipped]",
        ],
        "each fault at the reader, one of them judged by a batch, two commands and two calls",
    ),
    "tests/accept/gap/test_gap_fleet.py": Heavy(
        ["accept/gap", "accept/fleet"],
        ["test_fleet_of_simulated_struts"],
        "the search of one strut, in test_gap_cli.py",
    ),
    "tests/accept/gap/test_empirical.py": Heavy(
        ["accept/gap", "checks/gap"],
        ["test_written_reopened_and_never_worse", "test_a_pole_at_an_end_of_the_band_is_called_that[0.98-0]"],
        "shapes of the independent simulation, a pole at the other end of the band",
    ),
    "tests/accept/commands/test_fit_claims.py": Heavy(
        ["accept/analysis", "checks/fitting"],
        [
            "test_values_that_the_file_does_not_allow_explain_nothing",
            "test_one_convention_of_uncertainty_throughout",
            "test_a_search_that_goes_astray_is_not_written_as_a_fit",
        ],
        "an end that is worse than the start is given up; G of the fitted model",
    ),
    "tests/accept/fleet/population/test_learn.py": Heavy(
        ["accept/fleet/population", "checks/fitting"],
        [
            "test_a_strange_unit_is_told_and_moves_nothing",
            "test_units_with_nothing_in_common_are_no_batch",
            "test_units_of_which_none_belongs_end_in_a_sentence",
            "test_a_learned_model_fits_a_unit_that_it_was_not_learned_from",
        ],
        "mean and scatter of a batch, a unit outside of it, bad input",
    ),
    "tests/accept/commands/test_gap_cli.py": Heavy(
        ["accept/gap", "checks/misalignment"],
        [
            "test_misalignment_is_estimated_again_on_the_improved_model[strut]",
            "test_one_realisation_is_said",
            "test_nothing_is_missing_from_it",
        ],
        "the improved model is taken by every command",
    ),
    "tests/accept/fleet/population/test_recorded_bench.py": Heavy(
        ["accept/fleet/population", "checks/fitting"],
        [
            "test_latencies_are_those_of_converters_amplifier_and_filter",
            "test_a_misaligned_strut_is_measured_within_U",
            "test_the_one_with_an_effect_does_not_belong",
        ],
        "models learned from simulated batches, and a unit outside of them, in test_learn.py",
    ),
    "tests/accept/tui/test_tui_snapshots.py": Heavy(
        ["accept/tui"],
        [
            "test_the_screens_of_an_apa[100x30]",
            "test_the_screens_of_an_apa[140x40]",
            "test_the_screens_of_an_apa[80x24]",
            "test_the_screens_of_a_strut[100x30]",
            "test_the_screens_of_a_strut[140x40]",
            "test_without_colour_every_state_has_its_mark",
        ],
        "a strut at 80 by 24",
    ),
    "tests/accept/tui/test_tui.py": Heavy(
        ["accept/tui", "accept/workflow", "checks/acceptance", "checks/declare.py"],
        [
            "test_a_file_that_is_no_record_is_refused",
            "test_a_known_serial_goes_on_where_it_stood",
            "test_a_nonconformance_is_red_and_first_wherever_one_decides",
            "test_a_rejected_unit_is_countersigned_with_what_is_to_be_done_with_it",
            "test_arrows_go_from_line_to_line_where_the_form_is_longer_than_the_screen",
            "test_every_check_has_a_step_made_from_its_declaration_alone",
            "test_files_that_fit_come_first_and_letters_filter",
            "test_records_are_picked_and_the_bode_plot_appears",
            "test_help_on_every_screen",
            "test_when_storing_fails_the_entry_is_kept_and_enter_tries_again[error1-holds it locked]",
            "test_repeat_readings_show_their_scatter",
            "test_notes_and_nonconformance",
            "test_the_operator_and_the_serial_come_from_the_command_line",
        ],
        "a countersigned certificate, whose key is needed, nonsense, undo, a record of another unit, storing",
    ),
    "tests/accept/tui/test_tui_entries.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_a_file_that_is_refused_is_replaced_by_the_name_that_is_typed_next",
            "test_escape_closes_the_nearest_thing",
            "test_a_burst_from_the_list_of_units_through_two_steps_loses_no_key",
            "test_what_is_on_its_way_to_the_store_is_there_when_the_step_is_left[ctrl+q]",
        ],
        "entries of any speed, and what is on its way when Escape leaves the step; each kind of entry in "
        "tests/accept/workflow/dialogue",
    ),
    "tests/accept/tui/test_tui_gauge.py": Heavy(
        ["accept/tui", "accept/workflow", "hw"],
        [
            "test_a_stored_value_stands_in_its_limits_without_an_instrument",
            "test_nobody_looks_when_the_line_is_left",
            "test_a_stroke_is_measured_from_its_screen_and_undone_like_any_entry",
            "test_a_person_is_asked_and_stops_it",
        ],
        "a live value that is taken, an instrument that drops out",
    ),
    "tests/accept/tui/test_tui_models.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_a_long_computation_shows_its_clock_and_is_stopped[misalignment]",
            "test_a_step_without_records_says_which",
            "test_misalignment_is_found_shown_and_not_computed_again_after_a_restart",
            "test_pictures_that_come_faster_than_they_are_drawn_do_no_harm",
            "test_a_derived_step_stands_until_it_was_judged",
        ],
        "the gap analysis, found and kept, and one that is stopped",
    ),
    "tests/accept/tui/test_tui_training.py": Heavy(
        ["accept/tui", "accept/workflow", "accept/simulate", "accept/judging"],
        [
            "test_an_apa_with_a_reversed_plug_by_few_keys_then_put_right_and_accepted",
            "test_an_apa_by_mouse_alone_up_to_the_question_for_the_passphrase",
            "test_what_was_put_right_is_proposed_at_once",
            "test_what_does_not_help_leaves_the_fault_and_a_restart_keeps_what_was_put_right",
            "test_a_strut_of_a_chosen_kind_on_a_wrong_payload_by_few_keys",
            "test_a_spec_without_responses_can_be_practised_and_offers_no_remedy_for_them",
            "test_what_is_said_first_about_every_fault_is_the_right_action",
            "test_nothing_is_to_be_done_about_a_unit_without_a_fault",
            "test_a_strut_without_encoder_up_to_the_signature",
            "test_a_known_serial_that_comes_before_it_is_looked_up_opens_its_unit",
        ],
        "a strut in training in a real terminal, in test_terminal_run.py; what is said first of a fault of each kind, "
        "and nothing about a sound unit, in tests/accept/units/test_simulate.py; a sound one without encoder in "
        "test_strut_plates.py",
    ),
    "tests/accept/tui/terminal_programs/test_terminal_recorder.py": Heavy(
        ["accept/tui", "accept/capture", "hw/recorders"],
        ["test_from_the_hammer_to_the_certificate[audio]", "test_from_the_hammer_to_the_certificate[simulated]"],
        "the simulated recorder in tests/accept/workflow, a strut in a real terminal",
    ),
    "tests/accept/tui/terminal_programs/test_terminal_run.py": Heavy(
        ["accept/tui", "accept/workflow", "hw"],
        ["test_an_apa_from_its_serial_to_a_certificate_that_verifies[peers-80x24]"],
        "a strut in a real terminal; an APA by keys in test_tui.py",
    ),
    "tests/accept/tui/terminal_programs/test_terminal_kill.py": Heavy(
        ["accept/tui", "accept/store", "accept/workflow"],
        ["test_a_run_that_is_killed_again_and_again_loses_nothing[0]"],
        "killed among its keys, in test_tui_kill.py",
    ),
    "tests/accept/tui/test_web_chromium.py": Heavy(
        ["accept/tui"],
        [
            "test_a_unit_in_training_by_keys_in_a_browser",
            "test_keys_that_a_glove_hits_a_dropped_photo_and_plots_at_full_resolution",
        ],
        "the page and its sockets without a browser, in test_tui_web.py; Chromium, in tests/accept/fleet/test_site.py",
    ),
    "tests/accept/store/test_store_kill.py": Heavy(
        ["accept/store"],
        [
            "test_killed_at_every_point[new store]",
            "test_killed_again_and_again_at_random_points",
            "test_killed_at_random_moments",
        ],
        "killed at every point of an existing store",
    ),
    "tests/accept/store/test_store_postgres.py": Heavy(
        ["accept/store"],
        [
            "test_a_server_that_is_killed_under_two_benches",
            "test_a_connection_that_drops_at_any_message_of_a_read[check]",
            "test_a_connection_that_drops_at_any_message_of_a_read[last_of_each]",
            "test_a_connection_that_drops_at_any_message_of_a_read[judgements_with]",
            "test_a_connection_that_drops_at_any_message_of_an_append[cut before the bench hears]",
            "test_a_server_that_is_killed_in_mid_batch",
            "test_a_connection_that_drops_at_any_message_of_a_read[other_spelling]",
            "test_a_connection_that_drops_at_any_message_of_a_read[head]",
            "test_a_connection_that_drops_at_any_message_of_a_read[naming]",
            "test_a_connection_that_drops_at_any_message_of_a_read[latest]",
        ],
        "one chain of several benches, an append that the server never hears, a read of events",
    ),
    "tests/accept/store/test_store_parts.py": Heavy(
        ["accept/store"],
        [
            "test_a_filling_that_is_killed_is_done_again",
            "test_every_unit_that_names_a_part_is_found[1]",
            "test_every_unit_that_names_a_part_is_found[2]",
            "test_a_store_from_before_the_index_is_filled_once[earlier1]",
            "test_a_store_from_before_the_index_is_filled_once[earlier2]",
            "test_a_store_from_before_the_index_is_filled_once[earlier3]",
        ],
        "the filling itself, page by page; units found by their parts with another seed",
    ),
    "tests/accept/batch/test_batch_kill.py": Heavy(
        ["accept/batch", "accept/certificate", "accept/store"],
        ["test_killed_at_every_write"],
        "killed at random moments",
    ),
    "tests/accept/base/cluster/test_batch_on_cluster.py": Heavy(
        ["accept/base/cluster", "accept/batch"],
        ["test_the_scheduler_is_restarted"],
        "a worker that is killed, and one with other code",
    ),
    "tests/accept/base/cluster/test_other_work.py": Heavy(
        ["accept/base/cluster"],
        [
            "test_a_model_that_came_back_finds_its_files",
            "test_the_blind_test",
            "test_work_goes_on_when_every_worker_died",
            "test_what_was_handed_in_is_not_held",
            "test_a_worker_has_the_limit_of_memory_of_a_local_one",
            "test_a_table",
            "test_the_store_judged_again_from_records",
        ],
        "what the work raises, certificates of a batch and their keys, a folder that is not shared; a batch by "
        "killed workers, in test_batch_on_cluster.py",
    ),
    "tests/accept/gap/test_gap_and_misalignment.py": Heavy(
        ["checks/gap", "checks/misalignment"],
        ["test_a_recorded_unit", "test_what_more_data_make_narrower_is_said"],
        "a drawn strut, both on the same data",
    ),
    "tests/accept/gap/test_twelve_effects.py": Heavy(
        ["accept/gap", "accept/analysis", "checks/gap", "checks/misalignment", "checks/signals"],
        [
            "test_a_fault_of_sampling_is_said_or_refused[clipped]",
            "test_a_fault_of_sampling_is_said_or_refused[jitter]",
            "test_a_fault_of_sampling_is_said_or_refused[block of all lost]",
            "test_a_fault_of_sampling_is_said_or_refused[block of de lost]",
            "test_a_fault_of_sampling_is_said_or_refused[block of zeros]",
            "test_an_effect_on_the_responses_gets_no_false_name",
            "test_learning_leaves_an_affected_unit_out_by_name",
            "test_a_fault_of_sampling_is_said_or_refused[block held]",
        ],
        "each fault at the reader, by judging and by the gap and learning commands, in test_faulty_records.py; a "
        "delay of one channel by the search, in test_acquisition.py",
    ),
    "tests/accept/units/test_mass_steps.py": Heavy(
        ["accept/capture", "hw"],
        [
            "test_no_fault_gives_a_wrong_stiffness",
            "test_a_record_without_steps_is_said_at_once",
            "test_what_changes_within_a_record_ends_it[dual pass]",
            "test_a_round_trip_of_25_ms_makes_a_record",
        ],
        "a record followed at the bench up to its certificate, and what ends one",
    ),
    "tests/validation/test_generator.py": Heavy(
        ["validation"],
        [
            "test_weak_effects_are_weak_and_spread",
            "test_detectability_is_nothing_without_an_effect_and_grows_with_it",
            "test_a_new_effect_shifts_no_set_that_was_drawn",
            "test_a_seed_settles_everything_and_the_seal_notices_a_change",
            "test_the_cubic_spring_is_the_differential_equation",
            "test_recorded_struts_come_out_again[S-02]",
            "test_recorded_struts_come_out_again[S-03]",
            "test_recorded_struts_come_out_again[S-04]",
            "test_recorded_struts_come_out_again[S-05]",
        ],
        "recorded struts S-01 and S-06; an estimate from the records against its closed form, the mix, other effects"
        " by their definitions",
    ),
    "tests/validation/test_challenge.py": Heavy(
        ["validation", "checks/gap"],
        [
            "test_blind_units_get_no_false_name_and_no_false_alarm",
            "test_blind_units_get_their_right_name",
            "test_the_runner_hands_over_folders_and_keeps_what_was_said",
        ],
        "a run that is stopped and goes on, a workflow that crashes, scores against closed forms",
    ),
    "tests/test_docs.py": Heavy(
        ["docs/how-to/gap.md", "docs/tutorial/simulate.md", "accept/gap", "accept/simulate"],
        ["test_examples_run[gap.md]", "test_examples_run[simulate.md]"],
        "the examples of the README and other pages",
    ),
    "tests/accept/tui/test_tui_units.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_ten_capacitances_in_a_row_typed_without_waiting",
            "test_one_passphrase_for_a_shift_and_one_unit_after_the_other_to_sign",
            "test_a_scan_goes_to_its_unit_wherever_it_comes",
            "test_the_same_step_of_the_next_unit_by_one_key_and_what_was_found_is_said",
            "test_the_summary_is_left_when_the_certificate_is_signed_and_shown[escape]",
            "test_digits_that_fit_the_pattern_of_a_spec_are_a_serial",
        ],
        "a passphrase among other keys, a unit that is open elsewhere, a stray letter",
    ),
    "tests/checks/misalignment/test_estimate_proof.py": Heavy(
        ["checks/misalignment", "checks/fitting"],
        [
            "test_with_a_model_that_is_another[7000-10.0-20.0]",
        ],
        "struts of the matching model; a bench as it is by the model of struts as built, in test_believable.py",
    ),
    "tests/accept/fleet/test_month.py": Heavy(
        ["accept/fleet"],
        ["test_the_causes_of_many_months_are_named", "test_a_baseline_of_the_first_days_finds_the_same_causes"],
        "each cause in one month",
    ),
    "tests/accept/fleet/test_site.py": Heavy(
        ["accept/fleet", "accept/pictures"],
        [
            "test_more_units_than_a_table_shows_at_once",
            "test_the_page_says_what_the_trend_says",
            "test_no_button_of_a_plot_sends_anything",
            "test_paper_is_white_and_no_wider_than_a_sheet",
            "test_curves_lie_over_each_other",
        ],
        "in Chromium: filters, search and keys; nothing that stands in a unit runs",
    ),
    "tests/windows/test_windows.py": Heavy(
        ["accept", "hw", "checks", "specs"],
        ["test_the_whole_way_without_posix_modules"],
        "modules and functions that Windows lacks, by the source",
    ),
    "tests/test_site.py": Heavy(
        ["docs", "mkdocs.yml"],
        ["test_it_builds_without_a_warning"],
        "every page in the navigation, generated pages as they are",
    ),
    "tests/accept/pictures/test_pictures.py": Heavy(
        ["accept/pictures"],
        ["test_the_same_bytes_in_another_process_and_place"],
        "equal bytes in one process; a certificate in another process, in test_certificate.py",
    ),
    "tests/accept/pictures/pdf/test_panel_drawing.py": Heavy(
        ["accept/pictures"],
        ["test_the_same_bytes_in_another_process"],
        "a certificate in another process, in test_certificate.py",
    ),
    "tests/accept/commands/test_ctrl_c.py": Heavy(
        ["accept/base", "accept/gap", "accept/models", "accept/commands"],
        ["test_a_gap_analysis_that_is_stopped_leaves_nothing", "test_a_table_that_is_stopped_has_only_whole_rows"],
        "a batch that is stopped and goes on, a signal in the store",
    ),
    "tests/accept/store/test_store.py": Heavy(
        ["accept/store"],
        [
            "test_a_new_store_is_made_once_by_many_at_once",
            "test_a_home_that_everybody_writes_is_said[1023-False]",
            "test_a_home_that_everybody_writes_is_said[504-False]",
        ],
        "processes that keep one chain, a home that everybody writes",
    ),
    "tests/hw/records/test_records_fuzz.py": Heavy(
        ["hw/records"],
        ["test_every_header_word_at_its_extremes[v73-packed.mat]"],
        "the same of the other formats",
    ),
    "tests/accept/commands/test_hw_cli.py": Heavy(
        ["accept/commands/bench", "hw"],
        ["test_a_fault_asked_for_on_the_command_line"],
        "the bench as a program of its own; faults of instruments in tests/hw",
    ),
    "tests/checks/acceptance/test_responses.py": Heavy(
        ["checks/acceptance", "checks/signals"],
        [
            "test_recorded_struts[S-02]",
            "test_recorded_struts[S-03]",
            "test_recorded_struts[S-04]",
            "test_recorded_struts[S-06]",
            "test_recorded_apas[A-02]",
            "test_recorded_apas[A-03]",
            "test_recorded_struts[S-05]",
            "test_no_other_strut_has_one[S-02]",
            "test_no_other_strut_has_one[S-03]",
            "test_no_other_strut_has_one[S-05]",
            "test_no_other_strut_has_one[S-06]",
        ],
        "recorded units A-01, S-01 and S-04, all other rules",
    ),
    "tests/checks/acceptance/test_whole_apa.py": Heavy(
        ["checks/acceptance", "accept/capture", "hw/instruments", "hw/simulated"],
        ["test_it_is_judged_as_the_unit_that_stands_on_the_bench"],
        "records of the rig that are picked up and judged, in test_rig.py; recorded steps, in test_recording.py",
    ),
    "tests/accept/units/test_bench_errors.py": Heavy(
        ["accept/judging", "checks/consistency", "accept/simulate"],
        ["test_every_fault[strut-table1]"],
        "the faults of an APA; those of a strut alone, in test_simulate.py",
    ),
    "tests/accept/units/test_capture.py": Heavy(
        ["accept/capture", "hw"],
        [
            "test_a_passing_fault_costs_a_repeat_and_no_reading[half_line]",
            "test_a_passing_fault_costs_a_repeat_and_no_reading[echo_lost]",
            "test_a_passing_fault_costs_a_repeat_and_no_reading[unplug]",
        ],
        "garbage on a line, a fault that lasts; faults of instruments in tests/hw",
    ),
    "tests/accept/workflow/test_recording.py": Heavy(
        ["accept/capture", "accept/workflow", "hw/recorders"],
        ["test_responses_and_slow_sines_are_recorded"],
        "hits and a drive that are recorded and judged",
    ),
    "tests/plugins/test_plugins.py": Heavy(
        ["specs/plugins.py", "checks/declare.py", "checks/acceptance"],
        ["test_its_check_is_judged"],
        "the check of an installed product, in test_products.py; its instrument, its effect, broken ones",
    ),
    "tests/validation/test_intervals.py": Heavy(
        ["validation", "checks/acceptance", "checks/signals"],
        [
            "test_every_interval_holds_the_truth[frf of a strut]",
            "test_every_interval_holds_the_truth[spurious_modes]",
            "test_every_interval_holds_the_truth[frf of an APA]",
            "test_every_interval_holds_the_truth[frf with a second resonance]",
        ],
        "the intervals of the other checks; those of resonances, in tests/checks/acceptance",
    ),
    "tests/checks/gap/test_bench_paths.py": Heavy(
        ["checks/gap"],
        [
            "test_one_effect_is_named_exactly[misalignment-values0]",
            "test_one_effect_is_named_exactly[misalignment-values1]",
            "test_one_effect_is_named_exactly[payload_mass-values2]",
            "test_an_effect_is_named_beside_a_guide_that_gives_way[misalignment-values0]",
            "test_lags_that_have_names_keep_them",
            "test_a_sound_strut_on_a_guide_that_gives_way_has_no_name",
            "test_a_lag_of_the_drive_beside_others_has_no_form",
            "test_an_effect_is_named_beside_a_guide_that_gives_way[payload_mass-values1]",
            "test_creep_of_the_strut_and_losses_of_the_bench_are_one",
        ],
        "a scale of the encoder, a sound strut that lacks lags only; a payload by its name, and a lag whose form the"
        " band does not show, in test_gap_robust.py",
    ),
    "tests/checks/gap/search/test_screen.py": Heavy(
        ["checks/gap"],
        [
            "test_a_mode_of_the_bracket_beside_one_of_the_struts_own[596.0-0.009]",
            "test_a_tall_mode_of_the_bracket_beside_a_delay_and_soft_joints[480.0]",
            "test_a_tall_mode_of_the_bracket_beside_a_delay_and_soft_joints[860.0]",
        ],
        "a tall mode of the bracket beside other effects, one on a mode of the strut's own",
    ),
    "tests/checks/gap/test_read_point.py": Heavy(
        ["checks/gap"],
        ["test_a_ruler_read_beside_its_place_is_named"],
        "other effects by their names, in test_gap.py",
    ),
    "tests/checks/misalignment/test_as_built_proof.py": Heavy(
        ["checks/misalignment", "checks/fitting"],
        [
            "test_intervals_hold_where_modes_scatter[0.01]",
            "test_false_acceptance_is_no_more_frequent_than_stated[0.01]",
        ],
        "struts of the matching model within U, in test_estimate_proof.py; a bench as it is, in test_believable.py",
    ),
    "tests/checks/signals/test_hammer.py": Heavy(
        ["checks/signals"],
        ["test_intervals_cover_when_the_place_of_the_hit_varies", "test_intervals_cover_at_the_stated_rate[3]"],
        "intervals at the stated rate of 6 hits",
    ),
    "tests/checks/misalignment/test_estimate.py": Heavy(
        ["checks/misalignment", "checks/fitting"],
        [
            "test_recorded_with_the_right_model[S-02]",
            "test_recorded_with_the_right_model[S-03]",
            "test_recorded_with_the_right_model[S-06]",
            "test_recorded_with_the_built_in_model[S-05]",
            "test_recorded_with_the_built_in_model[S-06]",
        ],
        "two recorded struts with the right model, one of them with the built-in one as well",
    ),
    "tests/checks/misalignment/test_estimate_wrong.py": Heavy(
        ["checks/misalignment", "checks/fitting"],
        [
            "test_a_wrong_payload[5.0-builtin by itself]",
            "test_a_wrong_payload[6.4-builtin by itself]",
            "test_a_wrong_payload[10.0-builtin by itself]",
            "test_a_wrong_payload[5.0-finite elements by the frame]",
            "test_a_wrong_payload[6.4-finite elements by the frame]",
            "test_a_wrong_payload[5.3-finite elements by the frame]",
            "test_a_wrong_payload[6.1-builtin by itself]",
        ],
        "a payload that is too light with one model, one that is too heavy with the other, and one that is wrong by "
        "much",
    ),
    "tests/checks/misalignment/test_table.py": Heavy(
        ["checks/misalignment", "accept/models"],
        ["test_two_processes_give_the_same_table"],
        "a table whose building was killed and goes on",
    ),
    "tests/checks/misalignment/test_believable.py": Heavy(
        ["checks/misalignment", "checks/fitting"],
        ["test_a_bench_as_it_is[M-04]"],
        "a bench as it is, of another unit",
    ),
    "tests/accept/commands/test_command_line.py": Heavy(
        ["accept/cli", "accept/commands"],
        [
            "test_completion[zsh-excite sweep --no---notch]",
            "test_completion[fish-simulate un-unit]",
            "test_the_script_that_a_shell_sources[zsh]",
            "test_the_script_that_a_shell_sources[fish]",
        ],
        "completion and its script in bash",
    ),
    "tests/checks/misalignment/test_bench_not_learned.py": Heavy(
        ["checks/misalignment", "checks/fitting"],
        ["test_scales_of_channels_that_differ_are_within_U"],
        "a laboratory bench whose channels are apart and whose guide gives way, within U, in test_believable.py",
    ),
    "tests/checks/consistency/test_contradictions.py": Heavy(
        ["checks/consistency", "checks/acceptance"],
        ["test_recorded_units_do_not_contradict_themselves[S-03]"],
        "recorded A-01; the strut of the demo, which is accepted, in tests/accept/batch/test_batch.py",
    ),
    "tests/accept/batch/test_batch.py": Heavy(
        ["accept/batch", "accept/judging", "checks/acceptance"],
        [
            "test_recorded_units",
            "test_a_signed_certificate_is_set_aside_not_replaced[report]",
        ],
        "the units of the demo against what was published, judged and verified; recorded units by each check, in "
        "tests/checks/acceptance; a certificate that a batch sets aside",
    ),
    "tests/validation/test_methods.py": Heavy(
        ["validation"],
        ["test_every_method_gets_the_same_units_and_finished_ones_are_kept"],
        "finished units that are kept, in test_challenge.py; methods by their names, and their answers",
    ),
    "tests/checks/gap/search/test_settling.py": Heavy(
        ["checks/gap"],
        [
            "test_the_experiment_that_is_asked_for_leaves_the_right_place[hidden1-True]",
            "test_no_truth_is_refuted_end_to_end[0.0]",
            "test_an_element_that_an_experiment_refutes_is_not_stated",
        ],
        "the experiment for bellows, which refutes the other places; a contradiction of model and experiment, in "
        "test_conditions.py",
    ),
    "tests/checks/gap/test_common_offset.py": Heavy(
        ["checks/gap"],
        [
            "test_what_a_batch_has_in_common_is_no_name_of_a_unit[1.0]",
            "test_a_unit_off_its_batch_is_named_with_the_common_part_in_its_interval",
        ],
        "a unit at the mean of its batch, with the batch's model and without",
    ),
    "tests/validation/test_benches.py": Heavy(
        ["validation"],
        [
            "test_the_first_so_many_units_are_a_fair_mixture_and_the_same[laboratory]",
            "test_the_first_so_many_units_are_a_fair_mixture_and_the_same[struts]",
        ],
        "the mixture of two sets; six outsiders of either sort, far above noise and tolerance",
    ),
    "tests/accept/tui/test_tui_hints.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_undo_that_is_pressed_twice_takes_nothing_of_another_step_and_says_what_it_took",
            "test_a_photo_that_a_note_holds_is_not_proposed_again",
            "test_no_record_of_another_step_is_proposed_and_f2_has_the_proposal_on_top",
            "test_training_says_what_the_label_holds_and_its_keys_fit_into_80_columns",
            "test_what_is_saved_stands_in_one_column_until_something_is_typed[size1]",
        ],
        "the same keys and words as functions, in tests/accept/workflow/dialogue, names of files in "
        "test_record_folder.py, void and held units in test_nonconformance.py; on the screen, held and refused "
        "wherever it is named, columns of the smallest terminal",
    ),
    "tests/accept/tui/test_tui_start.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_a_serial_that_is_scanned_where_a_kind_is_chosen_is_another_unit_s",
        ],
        "the same keys in tests/accept/workflow/dialogue/test_start.py; a burst and a scan while the bench opens, on"
        " the screen",
    ),
    "tests/accept/tui/shown/test_tui_budgets.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_most_rows_of_the_screens_of_a_step_are_used",
        ],
        "the rows of the first screen, in test_first_screen.py; screens of a strut as they are, in "
        "test_tui_snapshots.py",
    ),
    "tests/accept/tui/shown/test_first_screen.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_no_serial_is_cut_and_every_unit_has_a_mark_per_step[120]",
            "test_no_serial_is_cut_and_every_unit_has_a_mark_per_step[200]",
        ],
        "the smallest of three sizes",
    ),
    "tests/accept/tui/shown/test_summary_screen.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_every_finding_has_its_gauge_and_no_cell_is_cut[(120, 36)]",
            "test_every_finding_has_its_gauge_and_no_cell_is_cut[(200, 60)]",
        ],
        "the smallest of three sizes",
    ),
    "tests/accept/tui/shown/test_hits.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_hit_now_stays_in_sight_with_the_hits_and_where_to_hit[(120, 36)]",
        ],
        "the smaller of two sizes",
    ),
    "tests/accept/tui/shown/test_plan.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_on_a_small_terminal_the_plan_is_behind_its_key",
        ],
        "the plan beside the heights",
    ),
    "tests/accept/tui/shown/test_tui_layout.py": Heavy(
        ["accept/tui", "accept/workflow"],
        [
            "test_no_two_stored_records_read_the_same[80]",
            "test_no_two_stored_records_read_the_same[120]",
            "test_no_two_stored_records_read_the_same[200]",
        ],
        "the narrowest of four widths",
    ),
    "tests/accept/tui/shown/test_tui_palette.py": Heavy(
        ["accept/tui", "accept/workflow"],
        ["test_a_step_is_opened_from_another_by_a_click_on_its_row"],
        "a step that is opened by its name; clicks on units and queues, in test_tui_start.py",
    ),
    "tests/accept/workflow/test_nonconformance.py": Heavy(
        ["accept/workflow", "accept/judging"],
        ["test_the_next_attempt_follows_the_disposition[scrap-conditional]"],
        "the same of rework and without a disposition; what is scrapped, by commands, in "
        "tests/accept/certificate/test_concession.py",
    ),
    "tests/accept/workflow/test_step_and_summary.py": Heavy(
        ["accept/workflow", "accept/judging"],
        ["test_every_step_says_of_its_quantities_what_the_summary_says[wrong_payload]"],
        "the same of a fault of the meter",
    ),
    "tests/accept/batch/test_reason_to_judge_again.py": Heavy(
        ["accept/batch", "accept/judging", "accept/commands/units"],
        [
            "test_a_rejected_unit[report]",
            "test_another_verdict_is_certified_without_a_reason_and_says_so[report]",
            "test_at_a_terminal_it_is_asked[batch]",
            "test_the_same_result_again_amends_nothing[batch]",
            "test_an_accepted_unit_that_is_measured_again_needs_a_reason[batch]",
            "test_without_a_reason_no_accepted_unit_is_amended[batch]",
        ],
        "each rule by one of the two commands, which certify the same: test_same_judgement.py in tests/accept/workflow",
    ),
}


def is_heavy(nodeid: str) -> bool:
    """Return whether a test stands in the table."""
    file, names = _names(nodeid)
    return file in HEAVY and not names.isdisjoint(HEAVY[file].tests)


def unknown(nodeids: Sequence[str]) -> list[str]:
    """Return the entries of the table that are none of these tests, of the files that these tests are from."""
    there: dict[str, set[str]] = {}
    for file, names in map(_names, nodeids):
        there.setdefault(file, set()).update(names)
    return [f"{f}::{test}" for f in HEAVY.keys() & there.keys() for test in HEAVY[f].tests if test not in there[f]]


def _names(nodeid: str) -> tuple[str, set[str]]:
    """Return the file of a test, and its name without and with its parameters."""
    file, _, rest = nodeid.partition("::")
    name, bracket, parameters = rest.partition("[")
    test = name.rpartition("::")[2]
    return file, {test, f"{test}{bracket}{parameters}"}


def runs(nodeid: str) -> bool:
    """Return whether a heavy proof runs: in the heavy lane, or because what it proves has changed."""
    file = nodeid.partition("::")[0]
    return SOAK or any(_has_changed(place) for place in (file, *(HEAVY[file].proves if file in HEAVY else ())))


def _has_changed(place: str) -> bool:
    return any(path == place or path.startswith(f"{place}/") for path in _changed())


@cache
def _changed() -> tuple[str, ...]:
    """Return the files that differ from the commit ACCEPT_SINCE; none without it."""
    if SINCE is None:
        return ()
    order = ["git", "diff", "--name-only", SINCE, "--"]
    return tuple(subprocess.run(order, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines())
