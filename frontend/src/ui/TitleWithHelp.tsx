import { Group, type GroupProps, Title, type TitleProps } from "@mantine/core";
import type { Ref } from "react";
import { HelpLink, type HelpTopic } from "./HelpLink";

interface TitleWithHelpProps extends Pick<TitleProps, "order" | "size" | "tabIndex">, Pick<GroupProps, "mb"> {
  /** The section of the manual; undefined: no link. */
  topic: HelpTopic | undefined;
  children: string;
  ref?: Ref<HTMLHeadingElement>;
}

/** A title, and at the end of its line the link to the manual's section about it. */
export function TitleWithHelp({ topic, mb = 0, children, ...title }: TitleWithHelpProps) {
  return (
    <Group justify="space-between" mb={mb}>
      <Title {...title}>{children}</Title>
      {topic && <HelpLink topic={topic} subject={children} />}
    </Group>
  );
}
