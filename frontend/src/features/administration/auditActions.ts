import "./catalogue";
import type { operations } from "../../lib/api/schema";
import { t } from "../../lib/i18n";

/** Operations of the API. Messages of a WebSocket are also described as posts, but they are not operations. */
type Operation = Exclude<keyof operations, `${string}_post` | Renamed>;

/** Operations that were renamed. The audit trail stores their former names. */
type Renamed =
  | "get_sign_in_options"
  | "set_side"
  | "reduce_range"
  | "request_erasure"
  | "approve_erasure"
  | "get_session_report_html"
  | "get_session_report_pdf"
  | "get_episode_report_html"
  | "get_episode_report_pdf"
  | "export_patient"
  | "list_ready_patients"
  | "get_session_filter_options"
  | "confirm_check"
  | "list_break_glass_accesses"
  | "review_break_glass_access"
  | "get_note_draft";

/** Other actions in the audit trail. A test of the service checks this list. */
type OtherAction =
  | "get_ways_in"
  | "note_erasure"
  | "erase_patient"
  | "get_session_page"
  | "get_session_pdf"
  | "get_episode_page"
  | "get_episode_pdf"
  | "get_whole_patient"
  | "list_ready"
  | "list_session_choices"
  | "tick_check"
  | "list_broken_glass"
  | "review_broken_glass"
  | "get_draft"
  | "turn"
  | "less"
  | "page"
  | "openapi"
  | "live"
  | "live_stations"
  | "at_the_door"
  | "unnamed"
  | "take_over"
  | "pause_without_browser"
  | "stop_without_browser"
  | "pause_contraindicated"
  | "service_started"
  | "service_ended"
  | "audit_broken"
  | "backup_nightly"
  | "backup_asked"
  | "backup_restored"
  | "database_away"
  | "import_questionnaire_texts"
  | "register_station"
  | "prepare_demonstration"
  | "adopt_time_zone"
  | "seed"
  | "import_journal"
  | "give_up_unended"
  | "never_begun"
  | "opened_without_database"
  | "pain_without_database"
  | "ended_without_database"
  | "begun_without_database"
  | "ticked_without_database";

/** The texts of actions by code. An operation without a text does not compile. */
export const ACTIONS: Readonly<Record<Operation | OtherAction, string>> = t("administration:actions", {
  returnObjects: true,
});
