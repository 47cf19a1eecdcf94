import { TextInput } from "@mantine/core";
import { useState } from "react";
import { useWho } from "./who";

/** Who works here: asked once, and remembered by this browser. */
export function WhoField() {
  const [who, say] = useWho();
  // Typed as it is; what is kept is without spaces around it.
  const [text, setText] = useState(who);
  return (
    <TextInput
      size="lg"
      label="Who is working here?"
      placeholder="Your name"
      maxLength={100}
      value={text.trim() === who ? text : who}
      onChange={(event) => {
        setText(event.currentTarget.value);
        say(event.currentTarget.value);
      }}
    />
  );
}
