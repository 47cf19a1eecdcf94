import { Group, Stack, Text } from "@mantine/core";
import { useId } from "react";
import classes from "./assessments.module.css";

const NUMBERS = Array.from({ length: 11 }, (_, number) => number);

/** A choice from 0 to 10. Pressing the chosen number again clears it. */
export function NumberPicker(props: {
  label: string;
  value: number | null;
  onChange: (value: number | null) => void;
}) {
  const id = useId();
  return (
    <Stack gap={4} role="group" aria-labelledby={id}>
      <Text fw={500} id={id}>
        {props.label}
      </Text>
      <Group gap={4} wrap="wrap">
        {NUMBERS.map((number) => (
          <button
            key={number}
            type="button"
            className={classes.number}
            aria-pressed={props.value === number}
            onClick={() => props.onChange(props.value === number ? null : number)}
          >
            {number}
          </button>
        ))}
      </Group>
    </Stack>
  );
}
