import alarms from "./alarms.json";
import app from "./app.json";
import assessments from "./assessments.json";
import auth from "./auth.json";
import common from "./common.json";
import digitalTwin from "./digital-twin.json";
import episodes from "./episodes.json";
import home from "./home.json";
import patientMode from "./patient-mode.json";
import patients from "./patients.json";
import progress from "./progress.json";
import reports from "./reports.json";
import search from "./search.json";
import sessions from "./sessions.json";
import station from "./station.json";
import statistics from "./statistics.json";
import ui from "./ui.json";

export default {
  alarms,
  app,
  assessments,
  auth,
  common,
  "digital-twin": digitalTwin,
  episodes,
  home,
  "patient-mode": patientMode,
  patients,
  progress,
  reports,
  search,
  sessions,
  station,
  statistics,
  ui,
};
