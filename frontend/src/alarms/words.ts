import type { Priority } from "./alarms";

/** What each priority is called; its colour says the same once more. */
export const PRIORITY_WORDS: Record<Priority, string> = {
  high: "High priority alarm",
  medium: "Medium priority alarm",
  low: "Low priority alarm",
};

export const WORDS = {
  lost: "Connection lost",
  lostNext:
    "What is greyed out is old. The Stop button may not reach the apparatus: use the emergency stop. The page goes on by itself once the connection is back.",
  restarting: "The apparatus' control program does not answer",
  restartingNext: "It is started again by itself; nothing that moved goes on by itself.",
  estopMissing: "The emergency stop's switch does not answer",
  estopMissingNext: "Nothing can be moved until it does. Check the switch's cable and its drive's power.",
  away: "The browser that operates the apparatus cannot be reached",
  awayNext: "Go to the patient. Somebody can take over here; otherwise the motors let go of the arm.",
  pedal: "The pedal does not answer",
  pedalNext: "Plug it in, and step on it once.",
  reversing: "The arm met resistance and is taken back",
  reversingNext: "Look after the patient before you play on.",
  databaseAway: (since: string) => `The database does not answer since ${since}`,
  databaseAwayNext:
    "Nothing is lost: what happens at the apparatus is kept on this computer and written there when it is back. What has begun goes on, and Stop works; signing in, records and beginning something have to wait.",
  notKept: (since: string) =>
    `Since ${since}, what happens at the apparatus is not kept: the disk takes nothing`,
  notKeptNext:
    "End what is going on, make room on this computer's disk, and tell whoever looks after this computer.",
  pauseSound: "Pause the sound for 2 minutes",
  soundPaused: "Sound paused. A new alarm sounds all the same.",
  soundOn: "Sound on again",
  noSound: "This browser gives no sound before somebody has pressed something here.",
};
