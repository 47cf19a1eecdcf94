import administration from "./administration.json";
import alarms from "./alarms.json";
import app from "./app.json";
import assessments from "./assessments.json";
import auth from "./auth.json";
import common from "./common.json";
import digitalTwin from "./digital-twin.json";
import episodes from "./episodes.json";
import fleet from "./fleet.json";
import importExport from "./import-export.json";
import patients from "./patients.json";
import programmes from "./programmes.json";
import progress from "./progress.json";
import recordings from "./recordings.json";
import reports from "./reports.json";
import sessions from "./sessions.json";
import station from "./station.json";
import ui from "./ui.json";

export default {
  administration,
  alarms,
  app,
  assessments,
  auth,
  common,
  "digital-twin": digitalTwin,
  episodes,
  fleet,
  "import-export": importExport,
  patients,
  programmes,
  progress,
  recordings,
  reports,
  sessions,
  station,
  ui,
};
